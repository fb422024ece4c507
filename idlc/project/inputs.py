"""Input files by package, and the names of the packages."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.diagnostics.text import worded
from idlc.model.ir import TypeName
from idlc.model.names import why_not_package
from idlc.project.files import decode, is_folder
from idlc.project.find import InterfaceFile, find, list_files
from idlc.project.package_xml import declared_name
from idlc.project.root import Root
from idlc.project.settings import Scope, load_settings, scope
from idlc.project.step import digest, meaning


def by_home(files: Iterable[InterfaceFile], root: Root) -> dict[Path, list[InterfaceFile]]:
    """Return files by the home folder of their package."""
    homes: dict[Path, list[InterfaceFile]] = {}
    for file in files:
        declared = root.manifest(file.root)
        homes.setdefault(declared.parent if declared else file.root, []).append(file)
    return homes


def separate_homes(homes: Mapping[Path, list[InterfaceFile]], root: Root) -> list[Path]:
    """Return the folders of packages if the files below them are no single package.

    Files without a package.xml from several arguments are one.
    """
    by_argument: dict[str, set[Path]] = {}
    for home, files in homes.items():
        for file in files:
            by_argument.setdefault(file.argument, set()).add(home)
    declared = [home for home in homes if root.manifest(home)]
    if len(declared) > 1 or any(len(folders) > 1 for folders in by_argument.values()):
        return sorted(homes)
    return []


def name_of(
    home: Path, digests: Callable[[], Mapping[str, str]], scope: Scope, report: Report
) -> tuple[str, str]:
    """Return a package's name, and a note about it if that is a guess.

    It is the name in the nearest package.xml, else that of the output in [tool.idlc], else the one
    that an idlc.lock nearby records for these files, else the folder's name.
    """
    declared = scope.root.manifest(home)
    if declared:
        name = declared_name(declared, scope.root, report)
        return name or home.name, ""
    name = _by_settings(home, scope) or _by_lock(home, scope.root, digests)
    if name:
        return name, ""
    note = f"without a package.xml, the package name is `{home.name}`; --package overrides it"
    return home.name, note


def _by_settings(home: Path, scope: Scope) -> str | None:
    """Return the name of `out` in [tool.idlc] if the package there is this one."""
    root = scope.root
    if not scope.out or not any(home.is_relative_to(root.absolute(path)) for path in scope.paths):
        return None
    homes = by_home(list_files(scope.paths, root, Report(), scope.exclude).files, root)
    if separate_homes(homes, root) or any(map(root.manifest, homes)):
        return None
    return root.absolute(scope.out).name


def output_folders(home: Path, root: Root) -> tuple[Path, ...]:
    """Return the folders in which outputs of a package are searched."""
    return tuple(dict.fromkeys((home, home.parent, root.base)))


def _by_lock(home: Path, root: Root, digests: Callable[[], Mapping[str, str]]) -> str | None:
    """Return the one name that locks nearby give to a package with these files."""
    names = {
        record.package
        for place in output_folders(home, root)
        for record in root.locks(place)
        if digests().keys() <= record.inputs.keys() and digests().items() & record.inputs.items()
    }
    return names.pop() if len(names) == 1 else None


def accept_name(name: str, origin: str, report: Report) -> bool:
    """Return whether a package can have a name and be imported; reports IDL607."""
    what = why_not_package(name)
    if not what:
        return True
    hint = worded("choose another name with --package NAME", "give it a package.xml with another")
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
    """The files of one package, in order, and their folders.

    `home` is the package's own folder. `borrowed` files were found as a dependency's are.
    """

    package: str
    files: tuple[Input, ...]
    folders: tuple[Path, ...]
    home: Path = Path()
    borrowed: bool = False

    @property
    def digests(self) -> dict[str, str]:
        """The SHA-256 of each file by its name within the package.

        For a borrowed one it is the digest of its meaning: the next run may find another copy.
        """
        contents = {entry.file.key: entry.data for entry in self.files}
        if self.borrowed:
            return {key: meaning(data.decode(), self.package) for key, data in contents.items()}
        return {key: digest(data) for key, data in contents.items()}

    def is_whole(self, root: Root) -> bool:
        """Return whether an argument is a folder, so that the package has no other interfaces."""
        return any(is_folder(Path(root.path(entry.file.argument))) for entry in self.files)

    @property
    def names(self) -> frozenset[TypeName]:
        """The names of the interfaces that its files define."""
        files = (entry.file for entry in self.files)
        return frozenset(TypeName(self.package, file.kind, file.name) for file in files)


def load(
    package: str, files: Iterable[InterfaceFile], home: Path, root: Root, report: Report
) -> Inputs:
    """Read a package's files; report IDL609 for each duplicate."""
    loaded: dict[str, Input] = {}
    for file in files:
        first = loaded.get(file.key)
        if first is not None:
            message = f"`{first.file.shown}` already defines `{file.kind}/{file.name}`"
            hint = "a package can have only one interface of each kind and name; " + worded(
                "exclude files with --exclude, or `exclude` in [tool.idlc]", "move one"
            )
            report.add(codes.DUPLICATE_INTERFACE.of(file.shown, message, hint=hint))
        elif (data := root.read_bytes(file.path, file.shown, report)) is not None:
            loaded[file.key] = Input(file, data)
    roots = dict.fromkeys(entry.file.root for entry in loaded.values())
    return Inputs(package, tuple(loaded[key] for key in sorted(loaded)), tuple(roots), home)


def packages(
    files: Iterable[InterfaceFile], scope: Scope, report: Report, empty: Iterable[Path] = ()
) -> tuple[Inputs, ...]:
    """Return files by package, each with its name; report IDL631 for a name of two packages.

    `empty` are the folders of packages that may be without interfaces.
    """
    files, root = tuple(files), scope.root
    homes = by_home(files, root)
    if scope.package is not None and homes:
        return (load(scope.package, files, min(homes), root, report),)
    read = [load("", own, home, root, report) for home, own in homes.items()]
    named = [_named(package_inputs, scope, report) for package_inputs in read]
    empty_homes = (home for home in sorted(set(empty)) if not homes.keys() & {home, *home.parents})
    named += [_named(Inputs("", (), (home,), home), scope, report) for home in empty_homes]
    return without_duplicates(named, root, report)


def _named(package_inputs: Inputs, scope: Scope, report: Report) -> Inputs:
    """Return a package with its name; a guess is noted."""
    name, guess = name_of(package_inputs.home, lambda: package_inputs.digests, scope, report)
    report.notes += [guess] if guess else []
    return msgspec.structs.replace(package_inputs, package=name)


def without_duplicates(
    candidates: Iterable[Inputs], root: Root, report: Report
) -> tuple[Inputs, ...]:
    """Return packages, the first of each name; report IDL631 for the others."""
    first: dict[str, Inputs] = {}
    for package_inputs in candidates:
        other = first.setdefault(package_inputs.package, package_inputs)
        if other is not package_inputs:
            home, elsewhere = root.shown(package_inputs.home), root.shown(other.home)
            message = f"package `{package_inputs.package}` is also in `{elsewhere}`"
            hint = "remove one of them, or create a COLCON_IGNORE file in its folder"
            report.add(codes.DUPLICATE_PACKAGE.of(home, message, hint=hint))
    return tuple(first.values())


def nearby_packages(root: Root) -> Mapping[str, Sequence[Path]]:
    """Return the folders of the packages that pyproject.toml names, or of the enclosing one."""
    declared = root.manifest(root.base)
    enclosing = (str(declared.parent),) if declared else ()
    return _packages(load_settings(root, Report()).paths or enclosing, root)


def packages_below(root: Root) -> Mapping[str, Sequence[Path]]:
    """Return the folders of all packages below the base; this searches every folder."""
    return _packages((".",), root)


def _packages(paths: Sequence[str], root: Root) -> dict[str, tuple[Path, ...]]:
    """Return folders by package; problems of files are reported when they are compiled."""
    ignored = Report()
    where = scope(load_settings(root, ignored))
    folders: dict[str, tuple[Path, ...]] = {}
    for package_inputs in packages(find(paths, root, ignored, where.exclude), where, ignored):
        folders.setdefault(package_inputs.package, package_inputs.folders)
    return folders
