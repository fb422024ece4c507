"""Input files by package: which files belong together, and under which name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.model.ir import TypeName
from idlc.project.files import decode, is_folder
from idlc.project.find import InterfaceFile, find, look
from idlc.project.lock import digest, meaning
from idlc.project.package_xml import declared_name
from idlc.project.root import Root
from idlc.project.settings import Scope, load_settings, scope


def by_home(files: Iterable[InterfaceFile], root: Root) -> dict[Path, list[InterfaceFile]]:
    """Return files by the folder that stands for their package."""
    found: dict[Path, list[InterfaceFile]] = {}
    for file in files:
        declared = root.manifest(file.root)
        found.setdefault(declared.parent if declared else file.root, []).append(file)
    return found


def several(homes: Mapping[Path, list[InterfaceFile]], root: Root) -> list[Path]:
    """Return the folders of packages if the files below them are no single package.

    Files without a package.xml that were given by several paths are one.
    """
    given: dict[str, set[Path]] = {}
    for home, files in homes.items():
        for file in files:
            given.setdefault(file.given, set()).add(home)
    declared = [home for home in homes if root.manifest(home)]
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
    declared = scope.root.manifest(home)
    if declared:
        name = declared_name(declared, scope.root, report)
        return name or home.name, ""
    name = _by_settings(home, scope) or _by_lock(home, scope.root, digests)
    if name:
        return name, ""
    note = f"no package.xml: `{home.name}` is taken for the package's name; --package sets another"
    return home.name, note


def _by_settings(home: Path, scope: Scope) -> str | None:
    """Return the name of `out` in [tool.idlc] if the package there is this one."""
    root = scope.root
    if not scope.out or not any(home.is_relative_to(root.absolute(path)) for path in scope.paths):
        return None
    homes = by_home(look(scope.paths, root, Report(), scope.exclude).files, root)
    if several(homes, root) or any(map(root.manifest, homes)):
        return None
    return root.absolute(scope.out).name


def places(home: Path, root: Root) -> tuple[Path, ...]:
    """Return the folders in which an output of a package is looked for."""
    return tuple(dict.fromkeys((home, home.parent, root.base)))


def _by_lock(home: Path, root: Root, digests: Callable[[], Mapping[str, str]]) -> str | None:
    """Return the one name that locks nearby give to a package with these files."""
    names = {
        known.package
        for place in places(home, root)
        for known in root.locks(place)
        if digests().keys() <= known.inputs.keys() and digests().items() & known.inputs.items()
    }
    return names.pop() if len(names) == 1 else None


def accept_name(name: str, origin: str, report: Report) -> bool:
    """Return whether a package can be called so and imported; reports IDL607."""
    from idlc.model.names import why_not_package  # a check needs no emitter

    what = why_not_package(name)
    if not what:
        return True
    hint = "choose another name with --package NAME"
    report.add(codes.UNIMPORTABLE_PACKAGE.of("", f"`{name}` (from {origin}) {what}", hint=hint))
    return False


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

    def is_whole(self, root: Root) -> bool:
        """Return whether a folder was given, so that what is not in it does not exist."""
        return any(is_folder(Path(root.path(one.file.given))) for one in self.files)

    @property
    def names(self) -> frozenset[TypeName]:
        """The names of the interfaces that its files define."""
        files = (one.file for one in self.files)
        return frozenset(TypeName(self.package, file.kind, file.name) for file in files)


def load(
    package: str,
    files: Iterable[InterfaceFile],
    home: Path,
    root: Root,
    report: Report,
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
        elif (data := root.read_bytes(file.path, file.shown, report)) is not None:
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
    root = scope.root
    if scope.package is not None and files:
        home = min(by_home(files, root))
        return (load(scope.package, files, home, root, report),)
    homes = by_home(files, root)
    read = [load("", own, home, root, report) for home, own in homes.items()]
    found = [_named(one, scope, report) for one in read]
    others = (home for home in sorted(set(empty)) if not homes.keys() & {home, *home.parents})
    found += [_named(Inputs("", (), (home,), home), scope, report) for home in others]
    return without_duplicates(found, root, report)


def _named(given: Inputs, scope: Scope, report: Report) -> Inputs:
    """Return a package with its name; a guess is noted."""
    name, guess = name_of(given.home, lambda: given.digests, scope, report)
    report.notes += [guess] if guess else []
    return msgspec.structs.replace(given, package=name)


def without_duplicates(found: Iterable[Inputs], root: Root, report: Report) -> tuple[Inputs, ...]:
    """Return packages, the first of each name; report IDL631 for the others."""
    first: dict[str, Inputs] = {}
    for one in found:
        other = first.setdefault(one.package, one)
        if other is not one:
            report.add(
                codes.DUPLICATE_PACKAGE.of(
                    root.shown(one.home),
                    f"package `{one.package}` is in `{root.shown(other.home)}` as well",
                    hint="remove one, or put a file COLCON_IGNORE into its folder",
                )
            )
    return tuple(first.values())


def near(root: Root) -> Mapping[str, Sequence[Path]]:
    """Return the folders of the packages that pyproject.toml names, or of the one around."""
    declared = root.manifest(root.base)
    around = (str(declared.parent),) if declared else ()
    return _packages(load_settings(root, Report()).paths or around, root)


def below(root: Root) -> Mapping[str, Sequence[Path]]:
    """Return the folders of all packages below the base; this looks at every folder."""
    return _packages((".",), root)


def names(root: Root) -> list[str]:
    """Return what is in the base."""
    try:
        return sorted(path.name for path in root.base.iterdir())
    except OSError:
        return []


def _packages(paths: Sequence[str], root: Root) -> dict[str, tuple[Path, ...]]:
    """Return folders by package; problems of files are reported when they are compiled."""
    ignored = Report()
    where = scope(load_settings(root, ignored))
    found: dict[str, tuple[Path, ...]] = {}
    for one in packages(find(paths, root, ignored, where.exclude), where, ignored):
        found.setdefault(one.package, one.folders)
    return found
