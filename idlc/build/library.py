"""The classes of a library, compiled while hatchling or setuptools build it.

`[tool.idlc]` says from what and where to, as for `idlc gen`. The classes are written into a folder
of the build; nothing is written into the project.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import msgspec

from idlc.build.content import generate, refuse_beside, required_prefixes
from idlc.build.hooks import require_runtime
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, ReportedError
from idlc.generate.package import NUMPY
from idlc.model.distros import DEFAULT
from idlc.model.names import is_module_name
from idlc.project.find import list_files
from idlc.project.lock import FILE
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
