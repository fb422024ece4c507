"""Names of packages: which files belong together, what they are called, and what may not be."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from pathlib import Path

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.disk.find import InterfaceFile, look
from idlc.disk.output import lock_file
from idlc.disk.packages.enclosing import declared_name, manifest
from idlc.disk.read import absolute, is_file, shown
from idlc.disk.scope import Scope


def by_home(files: Iterable[InterfaceFile]) -> dict[Path, list[InterfaceFile]]:
    """Return files by the folder that stands for their package."""
    found: dict[Path, list[InterfaceFile]] = {}
    for file in files:
        declared = manifest(file.root)
        found.setdefault(declared.parent if declared else file.root, []).append(file)
    return found


def several(homes: Mapping[Path, list[InterfaceFile]]) -> list[Path]:
    """Return the folders of packages if the files below them are no single package.

    Files without a package.xml that were given by several paths are one.
    """
    given: dict[str, set[Path]] = {}
    for home, files in homes.items():
        for file in files:
            given.setdefault(file.given, set()).add(home)
    declared = [home for home in homes if manifest(home)]
    if len(declared) > 1 or any(len(found) > 1 for found in given.values()):
        return sorted(homes)
    return []


def name_of(
    home: Path, digests: Callable[[], Mapping[str, str]], scope: Scope, report: Report
) -> tuple[str, str]:
    """Return a package's name, and a note about it if that is a guess.

    It is what the nearest package.xml says, else what [tool.idlc] compiles the files into, else
    what an idlc.lock nearby says of them, else the folder's name.
    """
    declared = manifest(home)
    if declared:
        name = declared_name(declared, shown(declared), report, scope.unsaved)
        return name or home.name, ""
    name = _by_settings(home, scope) or _by_lock(home, digests)
    if name:
        return name, ""
    note = f"no package.xml: `{home.name}` is taken for the package's name; --package sets another"
    return home.name, note


def _by_settings(home: Path, scope: Scope) -> str | None:
    """Return the name of `out` in [tool.idlc] if the package there is this one."""
    if not scope.out or not any(home.is_relative_to(absolute(path)) for path in scope.paths):
        return None
    homes = by_home(look(scope.paths, Report(), scope.exclude).files)
    return None if several(homes) or any(map(manifest, homes)) else absolute(scope.out).name


def places(home: Path) -> tuple[Path, ...]:
    """Return the folders in which an output of a package is looked for."""
    return tuple(dict.fromkeys((home, home.parent, Path.cwd())))


def _by_lock(home: Path, digests: Callable[[], Mapping[str, str]]) -> str | None:
    """Return the one name that locks nearby give to a package with these files."""
    names = {
        known.package
        for place in places(home)
        for known in locks(place)
        if digests().keys() <= known.inputs.keys() and digests().items() & known.inputs.items()
    }
    return names.pop() if len(names) == 1 else None


@lru_cache(maxsize=64)
def locks(place: Path) -> tuple[lock_file.Lock, ...]:
    """Return the locks of the generated packages in a folder."""
    try:
        folders = [one for one in place.iterdir() if is_file(one / lock_file.FILE)]
    except OSError:
        return ()
    return tuple(filter(None, (lock_file.load(folder, "", Report()) for folder in folders)))


def accept_name(name: str, origin: str, report: Report) -> bool:
    """Return whether a package can be called so and imported; reports IDL607."""
    from idlc.emit.package_name import why_not_package  # a check needs no emitter

    what = why_not_package(name)
    if not what:
        return True
    hint = "choose another name with --package NAME"
    report.add(codes.UNIMPORTABLE_PACKAGE.of("", f"`{name}` (from {origin}) {what}", hint=hint))
    return False
