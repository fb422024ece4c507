"""The kinds of folders that `idlc init` knows, and which of them a folder is.

Files are only read: nothing of a package runs, and a value that is computed is not guessed.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path, PurePosixPath
from typing import Any, Literal, NamedTuple, TypeAlias

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report, ReportedError, first_few
from idlc.diagnostics.source import Source
from idlc.diagnostics.terminal import counted
from idlc.model.names import is_module_name, why_not_package
from idlc.packaging.facts import home_of
from idlc.packaging.files import CMAKE_LISTS, SETUP_PY
from idlc.packaging.layout import SETUPTOOLS, build_backend
from idlc.project.files import entries, is_file
from idlc.project.find import CLOSING, KIND_FOLDERS, NOTHING, list_files
from idlc.project.package_xml import declared_name, read_statements
from idlc.project.root import MANIFEST, Root
from idlc.project.settings import SETTINGS_FILE, broken_toml, load_settings, scope, toml

LayoutKind: TypeAlias = Literal["ament_python", "ament_cmake", "library", "empty", "workspace"]

#: Files that may lie in a folder in which a package begins, and in a package's `src`.
_PLAIN = re.compile(r"(?i)\..*|(readme|licen[cs]e|copying|notice)\b.*|pyproject\.toml")
#: Folders of a project that hold no library.
_NO_LIBRARY = frozenset(
    "benchmarks build dist doc docs examples launch msg resource scripts test tests tools".split()
)
#: The tools behind the first name of a `build-backend`, where that is another name.
_TOOLS = {"flit_core": "flit", "uv_build": "uv"}


class Layout(NamedTuple):
    """A folder and its kind; `name` is the package's, `home` the Python package's folder in it.

    `backend` builds an installable one. `packages` are the folders in a workspace.
    """

    kind: LayoutKind
    folder: Path
    name: str = ""
    home: str = ""
    backend: str = ""
    packages: tuple[Path, ...] = ()

    def sentence(self, interfaces: str) -> str:
        """Return the sentence that says what the folder is, with the number of its interfaces."""
        match self.kind:
            case "ament_python":
                return f"{self.name} is an ament_python package with {interfaces}"
            case "ament_cmake":
                return f"{self.name} is a package for CMake with {interfaces}"
            case "library":
                where = f"in {self.home} (built with {tool_of(self.backend)})"
                return f"{self.name} is a Python library {where} with {interfaces}"
            case "workspace":
                return f"this is a workspace of {counted(len(self.packages), 'package')}"
        return f"this folder has no package yet; idlc creates the ament_python package {self.name}"


def layout_of(root: Root, report: Report) -> Layout:
    """Return the layout of a root's folder; ReportedError if it is not clear."""
    folder = root.base
    if is_file(folder / MANIFEST):
        return _of_manifest(root, report)
    document = _document(root, report)
    report.raise_errors()
    tool = document.get("tool", {})
    is_poetry = isinstance(tool, dict) and "poetry" in tool
    is_project = "project" in document or "build-system" in document or is_poetry
    config = load_settings(root, Report())
    exclude = scope(config).exclude if config.folder == folder else NOTHING
    listing = list_files((".",), root, report, exclude)
    is_outside = any(not _is_in(file.path, listing.packages) for file in listing.files)
    is_set = bool(config.out) and config.folder == folder
    # a library may contain packages for its tests, or beside its own interfaces
    aside = [package.relative_to(folder).parts[0] in _NO_LIBRARY for package in listing.packages]
    is_library = is_project and (is_outside or is_set or all(aside))
    if listing.packages and not is_library:
        return Layout("workspace", folder, packages=listing.packages)
    if is_project:
        return _library(root, document, report)
    if is_file(folder / SETUP_PY):
        return _library(root, {}, report)
    return _empty(root, report)


def _document(root: Root, report: Report) -> dict[str, Any]:
    """Return the content of pyproject.toml, empty without the file or after a report."""
    source = None
    if is_file(root.base / SETTINGS_FILE):
        source = root.read_source(SETTINGS_FILE, SETTINGS_FILE, report)
    try:
        return toml(source.text) if source else {}
    except ValueError as error:
        report.add(broken_toml(source or Source(SETTINGS_FILE, ""), str(error)))
        return {}


def _is_in(file: Path, packages: Iterable[Path]) -> bool:
    return any(file.is_relative_to(package) for package in packages)


def _of_manifest(root: Root, report: Report) -> Layout:
    folder = root.base
    name = declared_name(folder / MANIFEST, root, problems := Report())
    if not name:
        hint = "fix it, then run `idlc init` again"
        report.extend(msgspec.structs.replace(problem, hint=hint) for problem in problems)
        raise ReportedError
    why = why_not_package(name)
    if why:
        message = f"`{name}` {why}"
        raise report.refused(
            codes.BAD_PACKAGE_XML.of(MANIFEST, message, hint="change its `<name>`")
        )
    declared = read_statements(folder / MANIFEST, MANIFEST, root, report)
    types = [statement.text for statement in declared if statement.tag == "build_type"]
    # packages for both ROS versions have two, each with a condition
    types = [each for each in types if each in ("ament_python", "ament_cmake")] or types
    if types == ["ament_python"]:
        home = home_of(folder, name, root).relative_to(folder).as_posix()
        return Layout("ament_python", folder, name, home, backend=_backend(root, report))
    if types in ([], ["ament_cmake"]) and is_file(folder / CMAKE_LISTS):
        return Layout("ament_cmake", folder, name, f"build/{name}")
    kind = f"of the build type `{types[0]}`" if types else "without a build type"
    message = f"`{name}` is a package {kind}, but idlc only sets up ament_python and ament_cmake"
    hint = f"generate its classes with `idlc gen . -o build/{name}`"
    raise report.refused(codes.CANNOT_EDIT.of(MANIFEST, message, hint=hint))


def _backend(root: Root, report: Report) -> str:
    """Return the build backend of an ament_python package; colcon runs a setup.py first."""
    source = None
    if is_file(root.base / SETTINGS_FILE) and not is_file(root.base / SETUP_PY):
        source = root.read_source(SETTINGS_FILE, SETTINGS_FILE, report)
    document: dict[str, Any] = {}
    with suppress(ValueError):  # the settings in it are reported later
        document = toml(source.text) if source else {}
    return build_backend(document)


def _library(root: Root, document: dict[str, Any], report: Report) -> Layout:
    """Return the layout of a project without package.xml, by the Python package that it holds."""
    folder = root.base
    system, project = (
        table if isinstance(table := document.get(key), dict) else {}
        for key in ("build-system", "project")
    )
    backend = system.get("build-backend")
    backend = backend if isinstance(backend, str) else SETUPTOOLS
    if backend == "idlc.backend":
        message = f"`{backend}` builds ROS 2 packages, but there is no {MANIFEST}"
        hint = "`idlc scaffold package my_msgs --interfaces` creates a folder that you can build"
        raise report.refused(codes.NO_SUCH_PATH.of(MANIFEST, message, hint=hint))
    base, names = "src/", _python_packages(folder / "src")
    if not names:
        base, names = "", _python_packages(folder)
    own = re.sub(r"[-_.]+", "_", str(project.get("name", ""))).lower()
    name = own if own in names else next(iter(names), "")
    config = load_settings(root, report)
    out = config.out if config.folder == folder else ""
    if out or (name and (own in names or len(names) == 1)):
        name = name or own or PurePosixPath(out).parent.name  # without an __init__.py
        home = str(PurePosixPath(out).parent) if out else f"{base}{name}"
        return Layout("library", folder, name, home, backend)
    place = SETTINGS_FILE if document else SETUP_PY
    raise report.refused(_unclear_library(root, place, base, names))


def _unclear_library(root: Root, place: str, base: str, names: Sequence[str]) -> Diagnostic:
    """Return the problem with a project of several Python packages, or of none."""
    where = f"`{base or '.'}`"
    if not names:
        message = f"{where} has no Python package with an `__init__.py`"
        hint = "write the package first, or set `out` in [tool.idlc] to the folder for the classes"
        hint += ", then run `idlc init` again"
        return codes.CANNOT_EDIT.of(place, message, hint=hint)
    name = names[0]
    listed = first_few((f"`{each}`" for each in names), 4)
    message = f"{where} contains several Python packages ({listed}), "
    message += "but none with the project's name"
    hint = "add these lines to pyproject.toml, and set `out` to the package for the classes"
    files = list_files((".",), root, Report()).files
    places = sorted({root.shown(file.root) for file in files}) or ["interfaces"]
    detail = f"[tool.idlc]\npaths = {json.dumps(places)}\n"
    detail += f'package = "{package_of(name)}"\nout = "{base}{name}/ros"\nvendor-deps = true'
    return codes.CANNOT_EDIT.of(place, message, hint=hint, detail=detail)


def tool_of(backend: str) -> str:
    """Return the name of the tool that a build backend belongs to."""
    tool = backend.partition(".")[0]
    return _TOOLS.get(tool, tool)


def package_of(library: str) -> str:
    """Return the name that a library's types have in ROS 2."""
    return f"{_plain(library)}_msgs".strip("_")


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")


def _python_packages(folder: Path) -> list[str]:
    """Return the names of the Python packages in a folder, sorted."""
    named = (path for path in entries(folder) if is_module_name(path.name))
    return [
        path.name
        for path in named
        if path.name not in _NO_LIBRARY and is_file(path / "__init__.py")
    ]


def _belongs_to_empty(path: Path) -> bool:
    """Return whether a folder with such an entry counts as empty."""
    if _PLAIN.fullmatch(path.name) or path.name in KIND_FOLDERS:
        return True
    return any((path / marker).exists() for marker in CLOSING)


def _empty(root: Root, report: Report) -> Layout:
    """Return the layout of a folder that holds at most interfaces; its name is the package's."""
    folder = root.base
    others = [path.name for path in entries(folder) if not _belongs_to_empty(path)]
    name = _plain(folder.name)
    why = why_not_package(name)
    hint = "run `idlc scaffold package my_robot`, then `cd my_robot`"
    if others:
        listed = first_few((f"`{other}`" for other in others), 3)
        message = (
            "this folder has no package.xml, setup.py or project in pyproject.toml, but other "
        )
        message += f"files: {listed}"
        raise report.refused(codes.NO_SUCH_PATH.of(MANIFEST, message, hint=hint))
    if why:
        message = f"the folder's name is not a valid package name: `{name or folder.name}` {why}"
        raise report.refused(codes.UNIMPORTABLE_PACKAGE.of("", message, hint=hint))
    return Layout("empty", folder, name, name, backend=SETUPTOOLS)
