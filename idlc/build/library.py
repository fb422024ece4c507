"""The classes of a library, compiled while hatchling or setuptools build it.

`[tool.idlc]` says from what and where to, as for `idlc gen`. The classes are written into a folder
of the build; nothing is written into the project.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from importlib import import_module
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import msgspec

from idlc.build.content import generate, refuse_beside, required_prefixes
from idlc.build.hooks import finished, require_runtime
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, ReportedError
from idlc.generate.package import NUMPY
from idlc.model.distros import DEFAULT
from idlc.model.names import is_module_name
from idlc.project.find import list_files
from idlc.project.lock import FILE, load_lock
from idlc.project.root import Root
from idlc.project.settings import SETTINGS_FILE, TableLocation, load_settings, scope
from idlc.tasks.gen import GenOptions

#: Editable installations leave the project's folder on the path, where the classes are not.
_FINDER = '''\
"""Finds the classes of {module}, which are installed beside this file. Written by idlc."""

import os
import sys
from importlib.machinery import PathFinder


class Finder:
    """Looks here for the module and what is directly in it, after all other finders."""

    @staticmethod
    def find_spec(name, path=None, target=None):
        parent = name.rpartition(".")[0]
        if "{module}" not in (name, parent):
            return None
        here = os.path.dirname(os.path.abspath(__file__))
        return PathFinder.find_spec(name, [os.path.join(here, *parent.split("."))])


sys.meta_path.append(Finder)
'''
#: The import in modules with arrays of a fixed size.
_ARRAYS = b" import arrays as _arrays"


class CompiledLibrary(NamedTuple):
    """The classes of a library.

    `out` is their folder in the project, `module` the name by which that is imported, and `files`
    are the compiled files by their paths below it.
    """

    out: str
    module: str
    files: Mapping[str, Path]

    def finder(self) -> dict[str, str]:
        """Return files for site-packages by which an editable installation finds the classes."""
        name = f"_{self.module.replace('.', '__')}_idlc"
        return {f"{name}.py": _FINDER.format(module=self.module), f"{name}.pth": f"import {name}\n"}


def compile_library(
    project: Path,
    folder: Path,
    installed_path: Callable[[str], str],
    requirements: Iterable[str],
    report: Report,
) -> CompiledLibrary:
    """Compile the interfaces of a library into a folder. Raises ReportedError.

    `installed_path` returns the path below site-packages of a path in the project. `requirements`
    are those of the library.
    """
    root = Root.at(project)
    config = load_settings(root, report)
    missing = [key for key in ("paths", "out") if not getattr(config, key)]
    if missing:
        report.raise_errors()
    for key in missing:
        hint = "set `paths` to the interfaces, and `out` to the folder for the library's classes"
        message = f"[tool.idlc] has no `{key}`, so the build cannot compile interfaces"
        report.add(codes.BAD_CONFIG.of(SETTINGS_FILE, message, hint=hint))
    if missing or config.source is None:
        raise ReportedError
    out = os.path.normpath(config.out)
    parts = Path(installed_path(out)).parts
    if not parts or not all(map(is_module_name, parts)) or (root.base / out).is_file():
        place = TableLocation(config.source, "tool.idlc", "[tool.idlc]")
        message = f"the library cannot import from `out`, which is `{config.out}`"
        place.wrong("out", message, report, "set `out` to a folder in the library's package")
    refuse_beside(config, report)
    requirements = tuple(requirements)
    require_runtime(config, requirements, report)
    # the environment does not choose, because wheels for all distributions have one name
    where = scope(config, distro=",".join(config.distro) or DEFAULT.name)
    where = msgspec.structs.replace(where, include=(*where.include, *required_prefixes()))
    target, runtime, vendoring = folder / out, config.runtime, config.vendoring
    request = GenOptions(config.paths, where, str(target), runtime=runtime, vendoring=vendoring)
    report.raise_errors()
    generate(request, report)
    report.raise_errors()
    files = dict(_compiled_files(target, project / out))
    uses_numpy = any(_ARRAYS in path.read_bytes() for path in files.values())
    if uses_numpy and not any(map(NUMPY.match, requirements)):
        message = "the classes have arrays, which need numpy, but [project] does not require it"
        hint = 'add "numpy" to `dependencies`'
        report.add(codes.UNDECLARED_IMPORT.of(SETTINGS_FILE, message, hint=hint))
    return CompiledLibrary(Path(out).as_posix(), ".".join(parts), files)


def _compiled_files(target: Path, committed: Path) -> Iterator[tuple[str, Path]]:
    """Yield compiled files by their paths, with each `__init__.py` that describes a package."""
    for path in target.rglob("*.*"):
        name = path.relative_to(target)
        is_top = path.name == "__init__.py" and path.with_name(FILE).is_file()
        described = committed / name
        if is_top and described.is_file() and described.read_bytes() != path.read_bytes():
            yield name.as_posix(), described
        else:
            yield name.as_posix(), path


def sources(project: Path) -> list[str]:
    """Return the paths, relative to the project, of the files that a compilation reads.

    A source distribution contains them. Files outside of the project, to which links lead, are left
    out, because other people receive the archive. Problems are not reported.
    """
    root = Root.at(project)
    config = load_settings(root, Report())
    paths = (*config.paths, *config.include)
    listing = list_files(paths, root, Report(), scope(config).exclude)
    manifests = filter(None, (root.manifest(file.root) for file in listing.files))
    files = {*manifests, *(file.path for file in listing.files)}
    real = {path: Path(os.path.realpath(path)) for path in files}  # of circles, too
    return sorted(
        path.relative_to(root.base).as_posix()
        for path, target in real.items()
        if path.is_relative_to(root.base) and target.is_relative_to(root.base) and target.is_file()
    )


def build_command() -> type:
    """Return the command, a subclass of one of setuptools, which idlc does not require."""
    base: Any = import_module("setuptools").Command

    def initialize_options(self: Any) -> None:
        self.build_lib = None

    def finalize_options(self: Any) -> None:
        self.set_undefined_options("build", ("build_lib", "build_lib"))

    def run(self: Any) -> None:
        project, requirements = Path.cwd(), self.distribution.install_requires or ()
        site = Path(self.build_lib)
        if self.editable_mode:  # nothing is taken from there
            site = Path(self.get_finalized_command("install").install_lib)
        package_dir = self.distribution.package_dir or {}
        with TemporaryDirectory(prefix="idlc-") as folder:

            def build(report: Report) -> CompiledLibrary:
                installed_path = partial(_installed_path, package_dir)
                return compile_library(project, Path(folder), installed_path, requirements, report)

            library = finished(build)
            _install(library, site)
        if self.editable_mode:
            for name, text in library.finder().items():
                (site / name).write_text(text, encoding="utf-8")
        elif not self.distribution.has_pure_modules():
            self.distribution.has_pure_modules = lambda: True  # these are some

    def get_source_files(self: Any) -> list[str]:  # noqa: ARG001
        return sources(Path.cwd())

    methods = (initialize_options, finalize_options, run, get_source_files)
    attributes = {"editable_mode": False, "user_options": []}
    named = {method.__name__: method for method in methods}
    return type("build_idlc", (base,), {**attributes, **named})


def _install(library: CompiledLibrary, site: Path) -> None:
    """Copy files to where they are imported from, and remove those of an earlier build."""
    target = site.joinpath(*library.module.split("."))
    for lock_file in target.rglob(FILE):
        lock = load_lock(lock_file.parent, "", Report())
        for path in lock.outputs if lock else ():
            if path != "__init__.py":  # which may be people's
                (lock_file.parent / path).unlink(missing_ok=True)
    for path, source in library.files.items():
        (target / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, target / path)


def _installed_path(package_dir: Mapping[str, str], path: str) -> str:
    """Return the path below site-packages of a path, by the folders of packages.

    The path begins with `..` if setuptools packs nothing of its folder.
    """
    # setuptools has not seen a folder `src` that has only classes
    top = "src" if PurePath(path).parts[:1] == ("src",) else ""
    for package, folder in sorted({"": top, **package_dir}.items(), reverse=True):
        if PurePath(path).is_relative_to(folder):
            return str(PurePath(*package.split("."), PurePath(path).relative_to(folder)))
    return f"../{path}"
