"""Input files by package: which files belong together, and under which name."""

from __future__ import annotations

import keyword
from collections.abc import Iterable, Mapping
from importlib.machinery import BuiltinImporter, FrozenImporter
from pathlib import Path

import msgspec

from idlc.disk.find import InterfaceFile
from idlc.disk.lock import digest
from idlc.disk.package import declared_name, manifest
from idlc.disk.read import absolute, decode, read_bytes, shown
from idlc.model.ir import TypeName
from idlc.model.names import is_package_name
from idlc.text import codes
from idlc.text.diagnostics import Report
from idlc.text.source import Source

#: Modules that a starting Python has loaded, frozen or not, before it looks anywhere else.
_LOADED = frozenset(
    ("abc", "codecs", "encodings", "genericpath", "io", "ntpath", "os", "posixpath", "site", "stat")
)


class Input(msgspec.Struct, frozen=True):
    """An input file and its bytes."""

    file: InterfaceFile
    data: bytes

    def source(self, report: Report) -> Source | None:
        """Return its text; report IDL603 and return `None` if it is not text."""
        return decode(self.data, self.file.shown, report)


class Inputs(msgspec.Struct, frozen=True):
    """The files of one package, in order, and the folders that they lie in."""

    package: str
    files: tuple[Input, ...]
    folders: tuple[Path, ...]

    @property
    def digests(self) -> dict[str, str]:
        """The SHA-256 of each file by its name within the package."""
        return {one.file.key: digest(one.data) for one in self.files}

    @property
    def names(self) -> frozenset[TypeName]:
        """The names of the interfaces that its files define."""
        files = (one.file for one in self.files)
        return frozenset(TypeName(self.package, file.kind, file.name) for file in files)

    @property
    def own(self) -> dict[str, tuple[Path, ...]]:
        """Where a library finds the package's other files."""
        return {self.package: self.folders}


def _by_home(files: Iterable[InterfaceFile]) -> dict[Path, list[InterfaceFile]]:
    """Return files by the folder that stands for their package."""
    found: dict[Path, list[InterfaceFile]] = {}
    for file in files:
        declared = manifest(file.root)
        found.setdefault(declared.parent if declared else file.root, []).append(file)
    return found


def _name(home: Path, report: Report) -> str | None:
    """Return the name that a package's package.xml declares; `None` without one."""
    declared = manifest(home)
    return declared_name(declared, shown(declared), report) if declared else None


def _load(package: str, files: Iterable[InterfaceFile], report: Report) -> Inputs:
    """Read a package's files; report IDL609 for each that is there twice."""
    loaded: dict[str, Input] = {}
    for file in files:
        first = loaded.get(file.key)
        if first is not None:
            report.add(
                codes.DUPLICATE_INTERFACE.of(
                    file.shown,
                    f"`{file.key}` is defined by `{first.file.shown}` as well",
                    hint="a package can have one interface of a kind and name",
                )
            )
        elif (data := read_bytes(file.path, file.shown, report)) is not None:
            loaded[file.key] = Input(file, data)
    roots = dict.fromkeys(one.file.root for one in loaded.values())
    return Inputs(package, tuple(loaded[key] for key in sorted(loaded)), tuple(roots))


def packages(
    files: Iterable[InterfaceFile], package: str | None, report: Report
) -> tuple[Inputs, ...]:
    """Return files by package, each named by `package`, its package.xml or its folder."""
    if package is not None:
        return (_load(package, files, report),)
    return tuple(
        _load(_name(home, report) or home.name, own, report)
        for home, own in _by_home(files).items()
    )


def one_package(
    files: tuple[InterfaceFile, ...], package: str | None, out: str, report: Report
) -> Inputs | None:
    """Return all files as one package, named by `package`, the package.xml or OUT's folder.

    Returns `None` without files, and after IDL607 for a name that cannot be imported.
    Reports IDL608 for several packages.
    """
    if not files:
        return None
    homes = _by_home(files)
    origin = "--package"
    if package is None:
        _reject_several(homes, report)
        package = next((name for home in homes if (name := _name(home, report))), None)
        origin = "package.xml"
    if package is None:
        package = absolute(out).name
        origin = "the folder given with -o"
    if not accept_name(package, origin, report):
        return None
    return _load(package, files, report)


def _reject_several(homes: Mapping[Path, list[InterfaceFile]], report: Report) -> None:
    given: dict[str, set[Path]] = {}
    for home, files in homes.items():
        for file in files:
            given.setdefault(file.given, set()).add(home)
    declared = [home for home in homes if manifest(home)]
    several = next((sorted(found) for found in given.values() if len(found) > 1), None)
    if several is None and len(declared) > 1:
        several = sorted(declared)
    if several is None:
        return
    names = ", ".join(f"`{shown(home)}`" for home in several[:5])
    more = f" and {len(several) - 5} more" if len(several) > 5 else ""
    report.add(
        codes.SEVERAL_PACKAGES.of(
            shown(several[0].parent),
            f"these are {len(several)} packages: {names}{more}",
            hint="run idlc gen once for each, or give --package NAME to compile them as one",
        )
    )


def accept_name(name: str, origin: str, report: Report) -> bool:
    """Return whether a package can be called so and imported; reports IDL607."""
    if not is_package_name(name):
        what = "is not a package name: lower-case letters, digits and single underscores"
    elif keyword.iskeyword(name):
        what = "is a keyword of Python and cannot be imported"
    elif name in _LOADED or FrozenImporter.find_spec(name) or BuiltinImporter.find_spec(name):
        what = "is a module of Python itself, which would be imported instead"
    else:
        return True
    hint = "choose another name with --package NAME"
    report.add(codes.UNIMPORTABLE.of("", f"`{name}` (from {origin}) {what}", hint=hint))
    return False
