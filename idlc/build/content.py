"""The content of a wheel: classes, files that tools of ROS 2 look for, and metadata.

The metadata is a `[project]` table of what package.xml declares.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from idlc.compiler.compiler import models_of
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, ReportedError, first_few
from idlc.generate.prefix import Libraries, build_tag, libraries_of, shared
from idlc.model.names import why_not_package
from idlc.project.files import is_folder, read_bytes
from idlc.project.find import list_files, no_interfaces
from idlc.project.inputs import packages
from idlc.project.lock import Runtime, load_lock
from idlc.project.package_xml import Statement, declared_name, read_statements
from idlc.project.prefixes import INDEX, Distribution
from idlc.project.root import MANIFEST, Root
from idlc.project.settings import SETTINGS_FILE, Config, TableLocation, load_settings, scope, toml
from idlc.tasks.gen import GenOptions, gen
from idlc.version import RUNTIME


class Options(NamedTuple):
    """The settings of a frontend: the distribution of libraries, and whether there are any."""

    distribution: Distribution | None
    libraries: bool = True


class PrefixContent(NamedTuple):
    """The files of the prefix by their paths in it; `libraries` are those among them."""

    prefix: Mapping[str, bytes]
    libraries: Libraries


def compile_package(name: str, classes: Path, options: Options, report: Report) -> PrefixContent:
    """Compile the package in the working folder, its classes into a folder of their own.

    Raises ReportedError.
    """
    root = Root.here()
    config = load_settings(root, report)
    refuse_beside(config, report)
    if config.source and config.package not in ("", name):
        place = TableLocation(config.source, "tool.idlc", "[tool.idlc]")
        message = f"`package` is `{config.package}`, but package.xml names the package `{name}`"
        place.wrong("package", message, report, "remove `package` from [tool.idlc]")
    settings = scope(config, distro=options.distribution and options.distribution.name)
    include = (*settings.include, *required_prefixes())
    where = msgspec.structs.replace(settings, package=None, include=include)
    files = list_files((".",), root, report, where.exclude)
    if files.empty:
        report.add(no_interfaces(".", root, where.exclude))
    report.raise_errors()
    inputs = packages(files.files, where, report)
    if inputs and [package.package for package in inputs] != [name]:
        others = ", ".join(f"`{package.package}`" for package in inputs)
        message = f"the wheel is for `{name}`, but this folder contains interfaces of {others}"
        hint = "build each in its own folder, or exclude files with `exclude` in [tool.idlc]"
        report.add(codes.SEVERAL_PACKAGES.of(".", message, hint=hint))
    report.raise_errors()
    lock = load_lock(Path(name), name, report)
    # where classes are committed, people describe the package in the first of these
    kept = {Path(name, path) for path in ("__init__.py", *(lock.outputs if lock else ()))}
    own = sorted({*Path(name).rglob("*.py")} - kept)
    if own:  # the wheel would not have them
        listed = first_few((f"`{root.shown(path)}`" for path in own), 3)
        message = f"idlc.backend builds only interfaces, but this folder contains {listed}"
        hint = 'use `build-backend = "setuptools.build_meta"` with the setup.py of a package'
        report.add(codes.BAD_CONFIG.of(SETTINGS_FILE, message, hint=hint))
    runtime, vendoring = config.runtime, config.vendoring
    generate(GenOptions((".",), where, str(classes), runtime=runtime, vendoring=vendoring), report)
    manifest = read_bytes(Path(MANIFEST), MANIFEST, report)
    report.raise_errors()
    assert manifest is not None  # it was read, or reported
    ((_, model),) = models_of(inputs, where, Report())
    if options.libraries:
        libraries = libraries_of(model, options.distribution)
    else:
        libraries = Libraries({}, "the build has the setting `libraries=no`", build_tag(model))
    return PrefixContent(shared(model, manifest, libraries, report), libraries)


def refuse_beside(config: Config, report: Report) -> None:
    """Report IDL611 if packages of ROS 2 would be in the wheel."""
    if config.source and config.vendoring == "beside":
        message = "`vendor-deps` is `beside`: a wheel would overwrite ROS 2 packages"
        hint = "set it to true, so that the package contains the types that it uses"
        place = TableLocation(config.source, "tool.idlc", "[tool.idlc]")
        place.wrong("vendor-deps", message, report, hint)


def generate(request: GenOptions, report: Report) -> None:
    """Write classes, and report the problems.

    The environment of a build need not be able to import what the classes import.
    """
    problems = Report()
    with suppress(ReportedError):
        gen(request, problems)
    unimportable = codes.DEPENDENCY_NOT_IMPORTABLE.id
    report.extend(problem for problem in problems if problem.code != unimportable)


def required_prefixes() -> list[str]:
    """Return the folders of packages that frontends installed because pyproject.toml says so.

    They install what `requires` names on sys.path, and not always below sys.prefix.
    """
    ends = ("site-packages", "dist-packages")
    places = dict.fromkeys(Path(path) for path in sys.path if path.endswith(ends))
    prefixes = [place.parents[2] for place in places if len(place.parents) > 2]
    installed = [path for path in prefixes if is_folder(path / INDEX)]
    return [f"{path}/share" for path in installed if path != Path(sys.prefix)]


#: The packages on PyPI that every generated package needs. The packages of ROS 2 that it imports
#: are not among them: ROS 2 installs them, and anybody could register `std-msgs` there.
DEPENDENCIES = ("numpy",)
PYTHON = ">=3.10"
_VERSION = re.compile(r"\d+\.\d+\.\d+", re.ASCII)
_ADDRESS = re.compile(r"[\w.+-]+@[\w-]+(\.[\w-]+)*", re.ASCII)
_URLS = {"website": "Homepage", "repository": "Repository", "bugtracker": "Issues"}
_READMES = ("README.md", "README.rst", "README.txt")
#: Fields that package.xml, and files beside it, can provide.
_DYNAMIC = (
    *("version", "description", "readme", "requires-python", "license"),
    *("authors", "maintainers", "urls", "dependencies"),
)


def project(runtime: Runtime | None, report: Report) -> dict[str, Any]:
    """Return the table by the working folder's package.xml. Raises ReportedError."""
    root = Root.here()
    name = declared_name(root.base / MANIFEST, root, report)
    if name is None:
        raise ReportedError
    if why := why_not_package(name):
        hint = "change `<name>`, and its uses in other packages"
        raise report.refused(codes.UNIMPORTABLE_PACKAGE.of(MANIFEST, f"`{name}` {why}", hint=hint))
    statements = read_statements(root.base / MANIFEST, MANIFEST, root, report)
    report.raise_errors()
    version = _version(statements, report)
    table = {
        "name": name,
        "version": version,
        "description": next(iter(_texts(statements, "description")), ""),
        "readme": next(filter(lambda readme: Path(readme).is_file(), _READMES), None),
        "requires-python": PYTHON,
        "license": _license(_texts(statements, "license")),
        "authors": _people(statements, "author"),
        "maintainers": _people(statements, "maintainer"),
        "urls": _urls(statements),
        "dependencies": [*DEPENDENCIES, *((RUNTIME,) if runtime == "installed" else ())],
    }
    return {key: value for key, value in table.items() if value}


def _texts(statements: Iterable[Statement], tag: str) -> list[str]:
    """Return the texts of all statements with a tag, each on one line."""
    texts = (" ".join(statement.text.split()) for statement in statements if statement.tag == tag)
    return list(dict.fromkeys(filter(None, texts)))


def _version(statements: Iterable[Statement], report: Report) -> str:
    """Return the version; report IDL610 if there is none, or one that ROS 2 does not know."""
    hint = "write three numbers, as in `<version>0.1.0</version>`"
    for statement in statements:
        if statement.tag == "version":
            if _VERSION.fullmatch(statement.text):
                return statement.text
            message = f"`{statement.text}` is not a version of a ROS 2 package"
            raise report.refused(codes.BAD_PACKAGE_XML.at(statement.span, message, hint=hint))
    raise report.refused(codes.BAD_PACKAGE_XML.of(MANIFEST, "no version in this file", hint=hint))


def _license(names: Sequence[str]) -> str | dict[str, str] | None:
    """Return the licences, all of which hold, as an SPDX expression, or else as plain text."""
    from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

    parts = [f"({name})" if len(names) > 1 and " " in name else name for name in names]
    try:
        return canonicalize_license_expression(" AND ".join(parts)) if names else None
    except InvalidLicenseExpression:
        return {"text": ", ".join(names)}


def _people(statements: Iterable[Statement], tag: str) -> list[dict[str, str]]:
    """Return people; an address that mail programs would reject is left out."""
    people = []
    for statement in statements:
        if statement.tag == tag:
            address = statement.attributes.get("email", "").strip()
            email = address if _ADDRESS.fullmatch(address) else ""
            person = {"name": " ".join(statement.text.split()), "email": email}
            people.append({key: value for key, value in person.items() if value})
    return list(filter(None, people))


def _urls(statements: Iterable[Statement]) -> dict[str, str]:
    """Return the first address of each kind."""
    urls: dict[str, str] = {}
    for statement in statements:
        label = _URLS.get(statement.attributes.get("type", "website"))
        if statement.tag == "url" and label and len(statement.text.split()) == 1:
            urls.setdefault(label, statement.text)
    return urls


def complete_table(declared: dict[str, Any], report: Report) -> dict[str, Any]:
    """Return the table with what package.xml declares in place of what is absent or dynamic.

    Without a table all of it is taken. With one, as the standard demands, only the fields that
    `dynamic` names are taken.
    """
    path = Path(SETTINGS_FILE)
    document = toml(path.read_text(encoding="utf-8")) if path.is_file() else {}
    if "project" not in document:
        return declared
    table = document["project"]
    dynamic = table.get("dynamic", []) if isinstance(table, dict) else None
    if not isinstance(dynamic, list) or not all(isinstance(key, str) for key in dynamic):
        message = "`project` must be a table, and `dynamic` in it a list of strings"
        report.add(codes.BAD_CONFIG.of(SETTINGS_FILE, message))
        return {}
    for key in dynamic:
        if key not in _DYNAMIC:
            message = f"`dynamic` in [project] names `{key}`, which package.xml does not contain"
            hint = f"it can name {', '.join(f'`{name}`' for name in _DYNAMIC)}"
            report.add(codes.BAD_CONFIG.of(SETTINGS_FILE, message, hint=hint))
        elif key in table:
            message = f"`{key}` is both in [project] and in its `dynamic`"
            report.add(codes.BAD_CONFIG.of(SETTINGS_FILE, message, hint="remove one of them"))
    taken = {key: declared[key] for key in dynamic if key in declared}
    return {**table, **taken, "dynamic": []}
