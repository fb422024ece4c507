"""Input files by package: which files belong together, and under which name."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from pathlib import Path

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.disk.find import InterfaceFile
from idlc.disk.output.lock_file import digest, meaning
from idlc.disk.packages.names import by_home, locks, name_of
from idlc.disk.read import NOTHING_OPEN, Unsaved, decode, is_folder, shown
from idlc.disk.scope import Scope
from idlc.model.ir import TypeName


class Input(msgspec.Struct, frozen=True, dict=True):
    """An input file and its bytes."""

    file: InterfaceFile
    data: bytes

    def source(self, report: Report) -> Source | None:
        """Return its text; report IDL603 and return `None` if it is not text."""
        source, problems = self._decoded
        report.extend(problems)
        return source

    @cached_property
    def _decoded(self) -> tuple[Source | None, Report]:
        problems = Report()
        return decode(self.data, self.file.shown, problems), problems


class Inputs(msgspec.Struct, frozen=True):
    """The files of one package, in order, and the folders that they lie in.

    `home` is the folder that stands for the package. `borrowed` files were
    found as those of other packages are.
    """

    package: str
    files: tuple[Input, ...]
    folders: tuple[Path, ...]
    home: Path = Path()
    borrowed: bool = False

    @property
    def digests(self) -> dict[str, str]:
        """The SHA-256 of each file by its name within the package.

        Of a borrowed one it is that of its meaning: it may be found elsewhere the next time.
        """
        if self.borrowed:
            return {o.file.key: meaning(o.data.decode(), self.package) for o in self.files}
        return {one.file.key: digest(one.data) for one in self.files}

    @property
    def is_whole(self) -> bool:
        """Whether a folder was given, so that what is not in it does not exist."""
        return any(is_folder(Path(one.file.given)) for one in self.files)

    @property
    def names(self) -> frozenset[TypeName]:
        """The names of the interfaces that its files define."""
        files = (one.file for one in self.files)
        return frozenset(TypeName(self.package, file.kind, file.name) for file in files)


def load(
    package: str,
    files: Iterable[InterfaceFile],
    home: Path,
    report: Report,
    unsaved: Unsaved = NOTHING_OPEN,
) -> Inputs:
    """Read a package's files; report IDL609 for each that is there twice."""
    loaded: dict[str, Input] = {}
    for file in files:
        first = loaded.get(file.key)
        if first is not None:
            report.add(
                codes.DUPLICATE_INTERFACE.of(
                    file.shown,
                    f"`{file.key}` is defined by `{first.file.shown}` as well",
                    hint="a package can have only one interface of each kind and name; leave files "
                    "out with --exclude, or `exclude` in [tool.idlc]",
                )
            )
        elif (data := unsaved.read_bytes(file.path, file.shown, report)) is not None:
            loaded[file.key] = Input(file, data)
    roots = dict.fromkeys(one.file.root for one in loaded.values())
    return Inputs(package, tuple(loaded[key] for key in sorted(loaded)), tuple(roots), home)


def packages(
    files: Iterable[InterfaceFile], scope: Scope, report: Report, empty: Iterable[Path] = ()
) -> tuple[Inputs, ...]:
    """Return files by package, each with its name; report IDL631 for a name of two packages.

    `empty` are the folders of packages that may be without interfaces.
    """
    files = tuple(files)
    locks.cache_clear()
    if scope.package is not None and files:
        home = min(by_home(files))
        return (load(scope.package, files, home, report, scope.unsaved),)
    homes = by_home(files)
    read = [load("", own, home, report, scope.unsaved) for home, own in homes.items()]
    found = [_named(one, scope, report) for one in read]
    others = (home for home in sorted(set(empty)) if not homes.keys() & {home, *home.parents})
    found += [_named(Inputs("", (), (home,), home), scope, report) for home in others]
    return without_duplicates(found, report)


def _named(given: Inputs, scope: Scope, report: Report) -> Inputs:
    """Return a package with its name; a guess is noted."""
    name, guess = name_of(given.home, lambda: given.digests, scope, report)
    report.notes += [guess] if guess else []
    return msgspec.structs.replace(given, package=name)


def without_duplicates(found: Iterable[Inputs], report: Report) -> tuple[Inputs, ...]:
    """Return packages, the first of each name; report IDL631 for the others."""
    first: dict[str, Inputs] = {}
    for one in found:
        other = first.setdefault(one.package, one)
        if other is not one:
            report.add(
                codes.DUPLICATE_PACKAGE.of(
                    shown(one.home),
                    f"package `{one.package}` is in `{shown(other.home)}` as well",
                    hint="remove one, or put a file COLCON_IGNORE into its folder",
                )
            )
    return tuple(first.values())
