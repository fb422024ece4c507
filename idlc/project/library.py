"""Interfaces of other packages: along -I, in the ament prefixes, in the catalogue."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple, TypeAlias

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, first_few
from idlc.diagnostics.source import Source
from idlc.diagnostics.text import absence, closest, closest_package, did_you_mean, including
from idlc.model import catalog, derive, ir
from idlc.model.distros import DEFAULT, Distro
from idlc.project import inputs, prefixes
from idlc.project.files import GRAPH_HINT, entries, is_file, is_folder, near_path
from idlc.project.find import KIND_FOLDERS, KINDS, NOTHING, Exclusions, root_of, walk
from idlc.project.lock import FILE as LOCK
from idlc.project.package_xml import declared_name
from idlc.project.prefixes import installed
from idlc.project.root import MANIFEST, Root
from idlc.project.settings import Scope

#: The texts of interfaces by name.
InterfaceTexts: TypeAlias = Mapping[ir.TypeName, Source]

#: Folders by package.
Folders: TypeAlias = Mapping[str, Sequence[Path]]
#: Such files are written by ROS 2, and by people who do without interface files.
IDL = ".idl"
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


class Folder:
    """One -I folder: a package, a folder of packages, a source tree or an install prefix."""

    def __init__(self, path: str | Path, root: Root, *, idl: bool = False) -> None:
        self._path = root.absolute(path)
        self._root = root
        self._idl = idl

    def roots(self, package: str) -> Iterator[Path]:
        """Yield each folder that may hold the package's msg/, srv/ and action/ folders."""
        candidates = (self._path / package, self._path / "share" / package)
        yield from list(filter(_has_interfaces, candidates)) or self._packages.get(package, [])

    def packages(self) -> Iterable[str]:
        """Return the names of the packages found in it."""
        return self._packages

    @cached_property
    def _packages(self) -> dict[str, list[Path]]:
        """Every package at any depth, by name; made only when the direct look-up fails."""
        ignored = Report()
        by_name: dict[str, list[Path]] = {}
        files = walk(self._path, self._root, ignored)
        folders = {root_of(str(file.parent)) for file in files if self._is_of_interfaces(file)}
        for folder in sorted(folders):
            declared = self._root.manifest(folder)
            name = declared_name(declared, self._root, ignored) if declared else None
            by_name.setdefault(name or folder.name, []).append(folder)
        return by_name

    def _is_of_interfaces(self, file: Path) -> bool:
        """Return whether a file shows that there is a package of interfaces."""
        is_of_idl = self._idl and file.name == MANIFEST and _has_interfaces(file.parent)
        return file.suffix in KINDS or is_of_idl


class InstallPrefix:
    """An install prefix, which holds interfaces as share/PACKAGE/msg/Name.msg.

    Standard interfaces are ignored if it is of another distribution than files are read for.
    """

    def __init__(self, path: Path, distro: Distro) -> None:
        self._path = path
        self._share = path / "share"
        self._distro = distro

    @cached_property
    def _is_of_another(self) -> bool:
        distribution = installed(self._path)
        return bool(distribution and distribution.name and distribution.name != self._distro.name)

    def roots(self, package: str) -> Iterator[Path]:
        """Yield the folder of an installed package."""
        if not (self._is_of_another and catalog.is_standard(package)):
            yield self._share / package

    def packages(self) -> Iterable[str]:
        """Return the names of installed packages that have interfaces."""
        names = (path.name for path in entries(self._share) if _has_interfaces(path))
        return [name for name in names if any(self.roots(name))]


def _has_interfaces(root: Path) -> bool:
    kinds = [f"{root}/{kind}" for kind in KIND_FOLDERS if os.path.isdir(f"{root}/{kind}")]  # noqa: PTH112 - for each look
    if kinds and is_file(root / LOCK):  # these are the folders of classes
        return any(path.suffix in KINDS for kind in kinds for path in entries(Path(kind)))
    return bool(kinds)


class Library:
    """Interfaces of all packages that can be found from a root, as `link.Library`.

    `folders` are the -I ones; `own` maps the packages being compiled to their folders, so that
    a single file finds its neighbours, unless they are excluded, or returns them when they are
    needed. `texts` take precedence over
    files. Files that cannot be read are reported. `distro` is the distribution that files are read
    for. With `idl`, an .idl file that people wrote for ROS 2 defines what no interface file does.
    """

    def __init__(
        self,
        folders: Sequence[str],
        root: Root,
        report: Report,
        *,
        own: Folders | Callable[[], Folders] | None = None,
        exclude: Exclusions = NOTHING,
        distro: Distro = DEFAULT,
        texts: InterfaceTexts = MappingProxyType({}),
        idl: bool = False,
    ) -> None:
        self.distro = distro
        self._idl = idl
        self.texts = texts
        self._missing = [path for path in folders if not is_folder(Path(root.path(path)))]
        self._places: list[Folder | InstallPrefix] = [
            Folder(path, root, idl=idl) for path in folders
        ]
        self._places += [InstallPrefix(path, distro) for path in prefixes.ament_prefixes()]
        self._find_own = own if callable(own) else lambda: own or {}
        self._exclude = exclude
        self._root = root
        self._known: dict[str, list[Path]] = {}
        self._sources: dict[ir.TypeName, tuple[Source | None, Report]] = {}
        self._packages: list[str] | None = None
        self._listed: dict[str, list[tuple[ir.Kind, str]]] = {}
        self.report_to(report)

    @cached_property
    def _own(self) -> Folders:
        """The folders of the packages being compiled."""
        return self._find_own()

    def report_to(self, report: Report) -> None:
        """Report problems to another report from now on, also for interfaces read before."""
        self._report = report
        for path in self._missing:
            hint = near_path(path, Path(self._root.path(path))) or absence()
            report.add(codes.NO_SUCH_PATH.of(path, f"no such folder: `{path}`", hint=hint))

    def _roots(self, package: str) -> list[Path]:
        """Return the folders that may hold a package's interfaces, in order of precedence."""
        if package not in self._known:
            candidates = (root for place in self._places for root in place.roots(package))
            self._known[package] = [*self._own.get(package, ()), *filter(is_folder, candidates)]
        return self._known[package]

    def path(self, name: ir.TypeName) -> Path | None:
        """Return the file of an interface on disk, or `None`."""
        if not (_NAME.fullmatch(name.package) and _NAME.fullmatch(name.name)):
            return None
        file = f"{name.name}.{name.kind}"
        places = self._roots(name.package)
        inside = [f"{name.kind}/{file}", file]
        if self._idl:
            inside.append(f"{name.kind}/{name.name}{IDL}")
        paths = (f"{root}/{own}" for root in places for own in inside)
        exclude = self._excluded(name.package)
        files = (path for path in paths if self._root.is_file(path) and not exclude.has(path))
        return next(map(Path, files), None)

    def _excluded(self, package: str) -> Exclusions:
        """Return the exclusions for a package; they apply to the compiled ones only."""
        return self._exclude if package in self._own else NOTHING

    def source(self, name: ir.TypeName) -> Source | None:
        """Return the text of an interface, or `None` if there is none of that name."""
        if name in self.texts:
            return self.texts[name]
        if name not in self._sources:
            problems = Report()
            if path := self.path(name):
                source = self._root.read_source(path, self._root.shown(path), problems)
            else:
                # generated code is the same for all: it has events where ROS 2 has none, too
                of = DEFAULT if name == derive.SERVICE_EVENT_INFO else self.distro
                source = catalog.source(name, of)
            self._sources[name] = source, problems
        source, problems = self._sources[name]
        self._report.extend(problems)
        return source

    def names(self, package: str) -> Iterable[str]:
        """Return the names of a package's messages; empty for an unknown package."""
        in_texts = [name for of, kind, name in self.texts if (of, kind) == (package, "msg")]
        on_disk = [name for kind, name in self._on_disk(package) if kind == "msg"]
        return [*in_texts, *(on_disk or catalog.names(package, self.distro))]

    def interfaces(self, package: str) -> tuple[ir.TypeName, ...]:
        """Return every interface of a package, sorted."""
        on_disk = [ir.TypeName(package, kind, name) for kind, name in self._on_disk(package)]
        listed = on_disk or (*catalog.interfaces(self.distro), derive.SERVICE_EVENT_INFO)
        return tuple(sorted({name for name in (*listed, *self.texts) if name.package == package}))

    def _on_disk(self, package: str) -> list[tuple[ir.Kind, str]]:
        """Return kind and name of each file of a package, from the first place that has any.

        The package being compiled is one place, whatever the number of its folders.
        """
        if not _NAME.fullmatch(package):
            return []
        if package not in self._listed:
            exclude = self._excluded(package)
            folders = self._own.get(package, ())
            own = {interface for root in folders for interface in self._interfaces(root, exclude)}
            roots = () if own else self._roots(package)
            others = (self._interfaces(root, exclude) for root in roots)
            self._listed[package] = sorted(own) or next(filter(None, others), [])
        return self._listed[package]

    def home(self, package: str) -> Path | None:
        """Return the folder that a package's interfaces lie in; `None` if they are built in."""
        return next((root for root in self._roots(package) if self._interfaces(root)), None)

    def packages(self) -> Sequence[str]:
        """Return the names of all packages, sorted."""
        if self._packages is None:
            names = set(catalog.packages(self.distro)) | set(self._own)
            names |= {name.package for name in self.texts}
            self._packages = sorted(names.union(*(place.packages() for place in self._places)))
        return self._packages

    def nearby(self, package: str) -> str | None:
        """Return a hint at a package beside one of the compiled packages, if it is there."""
        for own in (folder for folders in self._own.values() for folder in folders):
            declared = self._root.manifest(own)
            beside = (declared.parent if declared else own).parent
            if _NAME.fullmatch(package) and _has_interfaces(beside / package):
                folder = self._root.relative(beside)
                return f"it is in `{Path(folder, package).as_posix()}`: {including(folder)}"
        return None

    def idl_file(self, name: ir.TypeName) -> str | None:
        """Return the path of the .idl file that defines a message, if there is one."""
        if not (_NAME.fullmatch(name.package) and _NAME.fullmatch(name.name)):
            return None
        paths = (root / "msg" / f"{name.name}.idl" for root in self._roots(name.package))
        return next((self._root.shown(path) for path in paths if is_file(path)), None)

    def _interfaces(self, root: Path, exclude: Exclusions = NOTHING) -> list[tuple[ir.Kind, str]]:
        """Return kind and name of each interface file of a folder and of its folders for kinds."""
        interfaces: set[tuple[ir.Kind, str]] = set()
        for folder in (root, *(root / kind for kind in KIND_FOLDERS)):
            new = (path for path in self._root.unsaved_below(folder) if path.parent == folder)
            interfaces |= {
                (KINDS[path.suffix], path.stem)
                for path in (*new, *filter(is_file, entries(folder)))
                if path.suffix in KINDS and not exclude.has(path)
            }
        return sorted(interfaces)


_DIVIDER = re.compile(r"/|\.|::")
_LISTED = 5


class AvailablePackage(NamedTuple):
    """A package in reach; `path` is `None` if it is built in."""

    name: str
    interfaces: int
    path: str | None


class ResolvedType(NamedTuple):
    """A type, and the interface whose file defines it."""

    name: ir.TypeName
    interface: ir.TypeName


def packages(scope: Scope, report: Report) -> list[AvailablePackage]:
    """Return all packages in reach, including the packages below the base."""
    library = _library(scope, report)
    homes = ((name, library.home(name)) for name in library.packages())
    return [
        AvailablePackage(
            name, len(library.interfaces(name)), scope.root.shown(home) if home else None
        )
        for name, home in homes
    ]


def interfaces(requested: Sequence[str], scope: Scope, report: Report) -> list[str]:
    """Return the names of all interfaces of packages; reports IDL618."""
    library = _library(scope, report)
    listed = []
    for package in requested:
        names = [str(interface) for interface in library.interfaces(package)]
        if not names:
            hint = did_you_mean(package, library.packages()) or "`idlc list` lists the packages"
            message = f"no such package: `{package}`"
            report.add(codes.NO_SUCH_TYPE.of("", message, hint=hint))
        listed += names
    return listed


def _library(scope: Scope, report: Report, *, is_whole: bool = True) -> Library:
    """Return the library of the packages nearby, and of all below the base if `is_whole`."""
    below = inputs.packages_below(scope.root) if is_whole else {}
    own = {**below, **inputs.nearby_packages(scope.root)}
    return Library(scope.include, scope.root, report, own=own, distro=scope.distro)


def resolve(text: str, scope: Scope, report: Report) -> tuple[Library, tuple[ResolvedType, ...]]:
    """Return the types that a text means, and the library that has them; reports IDL618.

    `package/kind/Name`, `package/Name` and `Name` mean one type, also with dots or `::`, and
    `package` means all of its interfaces. Folders below the base are searched last.
    """
    library = _library(scope, report, is_whole=False)
    types = _candidates(text, library)
    if not types:
        library = _library(scope, Report())
        types = _candidates(text, library)
    if len(types) == 1 or text in library.packages():
        return library, types
    if types:
        names = first_few((f"`{type_.name}`" for type_ in types), _LISTED)
        message, hint = f"`{text}` can be {len(types)} types", f"write one of {names}"
    else:
        message = f"no such type: `{text}`"
        if not _DIVIDER.search(text):
            message = f"no file, folder, package or type named `{text}`"
        hint = _similar(text, library, scope.root)
    report.add(codes.NO_SUCH_TYPE.of("", message, hint=hint))
    return library, ()


def _candidates(text: str, library: Library) -> tuple[ResolvedType, ...]:
    """Return every type that a text may mean."""
    match _DIVIDER.split(text):
        case [package, kind, name]:
            places = [(package, valid) for valid in ir.KINDS if valid == kind]
        case [package, name]:
            # as in interface files, it is a message if there is one
            if resolved := _resolved(ir.TypeName(package, "msg", name), library):
                return (resolved,)
            places = [(package, kind) for kind in ir.KINDS]
        case [package] if package in library.packages():
            return tuple(ResolvedType(own, own) for own in library.interfaces(package))
        case [name]:
            places = [(package, kind) for package in library.packages() for kind in ir.KINDS]
        case _:
            return ()
    names = (ir.TypeName(package, kind, name) for package, kind in places)
    return tuple(resolved for candidate in names if (resolved := _resolved(candidate, library)))


def _resolved(name: ir.TypeName, library: Library) -> ResolvedType | None:
    """Return a type and its interface, which for a derived type has a shorter name."""
    interface = name
    while library.source(interface) is None:
        shorter, _, rest = interface.name.rpartition("_")
        if not shorter or not rest or name.kind == "msg":
            return None
        interface = interface._replace(name=shorter)
    return ResolvedType(name, interface)


def _similar(text: str, library: Library, root: Root) -> str:
    """Return the hint with the closest name to a type's or package's, or the closest path."""
    parts, near_file = _DIVIDER.split(text), near_path(text, Path(root.path(text)))
    if near_file == GRAPH_HINT:  # rather than a type such as rosgraph_msgs/msg/Graph
        return near_file
    if len(parts) == 1:
        every = (name for package in library.packages() for name in library.interfaces(package))
        named = {interface.name: str(interface) for interface in every}
        files = (path.name for path in entries(root.base))
        near = closest(parts[0], [*files, *named, *library.packages(), "dds"])
        if near:
            return f"did you mean `{named.get(near, near)}`?"
        return near_file or "`idlc list` lists the known packages and types"
    package = closest_package(parts[0], library.packages())
    if package is None:
        missing = f"package `{parts[0]}` not found; add its folder with -I, or source its workspace"
        return near_file or missing
    named = {interface.name: str(interface) for interface in library.interfaces(package)}
    near = closest(parts[-1], named)
    if near:
        return f"did you mean `{named[near]}`?"
    return near_file or f"`idlc list {package}` lists its types"
