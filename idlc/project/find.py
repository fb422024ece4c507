"""Finding interface files: which files the paths on the command line mean, in a fixed order."""

from __future__ import annotations

import os
import stat
import time
from collections.abc import Iterable, Iterator, Mapping
from fnmatch import fnmatchcase
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report
from idlc.model.ir import Kind
from idlc.project.files import is_file, is_folder, kind_of, unreadable
from idlc.project.root import MANIFEST, Root

#: The names of each pattern, and the folder that the paths are relative to.
_Patterns: TypeAlias = tuple[tuple[tuple[str, ...], ...], Path]


class Exclusions(msgspec.Struct, frozen=True):
    """Patterns such as `msg/ros1/**` or `old_*`, by the folder that their paths are relative to.

    `*` and `?` stand for any text within one name, `**` for any number of folders. A pattern may
    begin at any folder, and one that fits a folder leaves out everything in it.
    """

    parts: tuple[_Patterns, ...] = ()

    def has(self, path: str | Path) -> bool:
        """Return whether the file of an absolute path is left out."""
        for patterns, base in self.parts:
            whole = Path(path)
            names = whole.relative_to(base if whole.is_relative_to(base) else whole.anchor).parts
            if any(_fits(pattern, names) for pattern in patterns):
                return True
        return False

    def seen_from(self, place: Path, top: Path) -> Exclusions:
        """Return the same for a copy of the folder `top` that lies in `place`."""
        parts = (
            (patterns, place / base.relative_to(top) if base.is_relative_to(top) else base)
            for patterns, base in self.parts
        )
        return Exclusions(tuple(parts))


def exclusion(patterns: Iterable[str], base: Path) -> Exclusions:
    """Return the exclusion by patterns that are written in the folder `base`."""
    split = (pattern.replace("\\", "/").split("/") for pattern in patterns)
    named = (tuple(name for name in names if name not in ("", ".")) for names in split)
    return Exclusions(((tuple(filter(None, named)), base),))


def _fits(pattern: tuple[str, ...], names: Iterable[str]) -> bool:
    """Return whether a pattern fits a file or a folder above it, from any folder on."""
    reached = _with_none(pattern, {0})
    for name in names:
        if len(pattern) in reached:
            break
        after = {0}
        for place in reached:
            if pattern[place] == "**":
                after.add(place)
            elif fnmatchcase(name, pattern[place]):
                after.add(place + 1)
        reached = _with_none(pattern, after)
    return len(pattern) in reached


def _with_none(pattern: tuple[str, ...], places: set[int]) -> set[int]:
    """Return places in a pattern, with places that are reached where `**` matches no folder."""
    for place in sorted(places):
        while place < len(pattern) and pattern[place] == "**":
            place += 1
            places.add(place)
    return places


KINDS: dict[str, Kind] = {".msg": "msg", ".srv": "srv", ".action": "action"}
KIND_FOLDERS = frozenset(KINDS.values())
#: The folder of rules for recordings of earlier versions, beside those.
RULES = "upgrade"
#: Folders with copies or without sources, which colcon and Python tools write.
SKIPPED = frozenset({"build", "install", "log", "__pycache__", "node_modules", "site-packages"})
#: Files that close a folder to searches: colcon's and ament's markers, a virtual environment.
CLOSING = frozenset({"COLCON_IGNORE", "AMENT_IGNORE", "pyvenv.cfg"})
NOTHING = Exclusions()


class InterfaceFile(msgspec.Struct, frozen=True):
    """An interface file: its absolute path, and the path by which messages call it.

    `argument` is the path on the command line that led to it, `root` the folder that holds the
    msg/, srv/ and action/ folders, or the file's own.
    """

    path: Path
    shown: str
    kind: Kind
    name: str
    argument: str
    root: Path

    @property
    def key(self) -> str:
        """The name within the package, such as `msg/RobotCommand.msg`."""
        return f"{self.kind}/{self.name}.{self.kind}"


class FileListing(msgspec.Struct, frozen=True):
    """The files below some paths: interface files, each once, sorted, and the folders of packages.

    `empty` are the listed folders without interface files, `folders` all that were searched, by
    absolute path, with their status from before the search.
    """

    files: tuple[InterfaceFile, ...]
    packages: tuple[Path, ...]
    empty: tuple[str, ...]
    folders: Mapping[Path, os.stat_result]


def find(
    paths: Iterable[str], root: Root, report: Report, exclude: Exclusions = NOTHING
) -> tuple[InterfaceFile, ...]:
    """Return the interface files that paths mean; reports IDL606 for a path that means none."""
    listing = list_files(paths, root, report, exclude)
    report.extend(no_interfaces(folder, root, exclude) for folder in listing.empty)
    return listing.files


def no_interfaces(
    folder: str, root: Root, exclude: Exclusions = NOTHING, *, also: str = ""
) -> Diagnostic:
    """Return the problem with a folder without interface files, and without files of `also`."""
    if exclude is not NOTHING and list_files((folder,), root, Report()).files:
        message = f"every interface file in `{folder}` is excluded"
        return codes.NO_INTERFACES.of(folder, message, hint="see `exclude` in [tool.idlc]")
    message = f"no {also}.msg, .srv or .action file in `{folder}`"
    hint = "idlc searches the folder itself and its msg/, srv/ and action/ folders"
    return codes.NO_INTERFACES.of(folder, message, hint=hint)


def list_files(
    paths: Iterable[str], root: Root, report: Report, exclude: Exclusions = NOTHING
) -> FileListing:
    """Return the files that paths mean; a folder means everything below it.

    Reports IDL601, IDL602, IDL605 and IDL622.
    """
    by_path: dict[str, InterfaceFile] = {}
    packages: dict[Path, None] = {}
    empty: dict[str, None] = {}
    folders: dict[Path, os.stat_result] = {}
    for argument in paths:
        has_files = not is_folder(Path(root.path(argument)))
        for path in _files_of(argument, root, report, folders):
            whole = os.path.normpath(root.path(path))
            if exclude.has(whole):
                continue
            if path.name == MANIFEST:
                packages.setdefault(Path(whole).parent)
            elif path.suffix not in KINDS:
                extension = path.suffix.lower()
                message = f"idlc skips `{path.name}`, because ROS 2 reads only `{extension}`"
                hint = f"rename it to `{path.stem}{extension}`"
                report.add(codes.UNREAD_FILE.of(path.as_posix(), message, hint=hint))
            else:
                has_files = True
                place, kind = Path(root.path(path)), KINDS[path.suffix]
                home = root_of(os.path.dirname(whole))  # noqa: PTH120 - a Path takes as long again
                file = InterfaceFile(place, path.as_posix(), kind, path.stem, argument, home)
                by_path.setdefault(whole, file)
        if not has_files:
            empty.setdefault(argument)
    files = sorted(by_path.values(), key=lambda file: (file.shown, file.argument))
    return FileListing(tuple(files), tuple(sorted(packages)), tuple(empty), folders)


def _files_of(
    argument: str, root: Root, report: Report, folders: dict[Path, os.stat_result]
) -> Iterator[Path]:
    """Yield the interface and package.xml files that one path means; note folders as `walk`."""
    path = Path(argument)
    if path.suffix in KINDS and root.is_file(path) and not Path(root.path(path)).exists():
        yield path
        return
    try:
        mode = os.stat(root.path(path)).st_mode  # noqa: PTH116 - no Path is needed
    except (OSError, ValueError) as error:
        report.add(unreadable(argument, Path(root.path(path)), error))
        return
    if stat.S_ISDIR(mode):
        yield from walk(path, root, report, folders)
        whole = root.absolute(path)
        for new in root.unsaved_below(whole):
            inside = new.relative_to(whole)
            if _is_wanted(new.name) and not _is_closed(whole, inside.parts[:-1]):
                yield path / inside
    elif path.suffix not in KINDS or not stat.S_ISREG(mode):
        what = "" if stat.S_ISREG(mode) else f"{kind_of(mode)}, "
        message = f"`{argument}` is {what}not a .msg, .srv or .action file"
        report.add(codes.NOT_AN_INTERFACE.of(argument, message))
    else:
        yield path


@lru_cache(maxsize=1024)
def root_of(folder: str) -> Path:
    """Return the parent of a folder for one kind of interface; any other folder itself."""
    path = Path(folder)
    return path.parent if path.name in KIND_FOLDERS else path


def walk(
    folder: Path, root: Root, report: Report, folders: dict[Path, os.stat_result] | None = None
) -> Iterator[Path]:
    """Yield each interface file and package.xml below a folder, in no particular order.

    Paths begin as the folder's does. `folders` gets the status of each folder from before it was
    listed. Files whose extensions have capitals, which ROS 2 does not read, are included.

    Hidden folders, `SKIPPED` ones and folders with a `CLOSING` file are left out, except `folder`
    itself; links to folders are followed, each folder once, except links that a git repository
    has and that lead out of it.
    """
    waiting = [folder]
    visited: set[tuple[int, int]] = set()
    while waiting:
        current = waiting.pop()
        try:
            status = os.stat(place := root.path(current))  # noqa: PTH116 - no Path is needed
            if folders is not None:
                folders[root.absolute(current)] = status
            inside = sorted(os.scandir(place), key=lambda entry: entry.name)
        except OSError as error:
            report.add(unreadable(current.as_posix(), Path(root.path(current)), error))
            continue
        identity = (status.st_dev, status.st_ino)
        is_closed = current != folder and any(entry.name in CLOSING for entry in inside)
        if is_closed or (identity in visited and status.st_ino):
            continue
        visited.add(identity)
        for entry in inside:
            if _is_folder(entry):
                if entry.name.startswith(".") or entry.name in SKIPPED:
                    continue
                if entry.is_symlink() and root.leads_out(os.path.join(place, entry.name)):  # noqa: PTH118
                    report.add(_link_out((current / entry.name).as_posix()))
                else:
                    waiting.append(current / entry.name)
            elif not entry.name.startswith(".") and _is_wanted(entry.name):
                yield current / entry.name


def _link_out(name: str) -> Diagnostic:
    message = f"idlc skips `{name}`, a link that leads out of its git repository"
    return codes.UNREAD_FILE.of(name, message, hint="name the folder with `-I`, or as a PATH")


def _is_closed(folder: Path, inside: Iterable[str]) -> bool:
    """Return whether `walk` would not reach a folder within another."""
    for name in inside:
        folder /= name
        is_skipped = name.startswith(".") or name in SKIPPED
        if is_skipped or any(is_file(folder / marker) for marker in CLOSING):
            return True
    return False


def _is_wanted(name: str) -> bool:
    suffix = os.path.splitext(name)[1]  # noqa: PTH122 - for every file of a source tree
    return suffix.lower() in KINDS or name == MANIFEST


def _is_folder(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_dir()
    except OSError:
        return False


def unread_idl(folders: Iterable[Path], exclude: Exclusions) -> list[str]:
    """Return the .idl files of a package without a .msg, .srv or .action file beside, sorted."""
    unread = []
    for folder in folders:
        for kind in KINDS:
            inside = folder / kind[1:]
            try:
                names = {entry.name for entry in os.scandir(inside)}
            except OSError:
                continue
            unread += [
                f"{kind[1:]}/{name}"
                for name in names
                if name.endswith(".idl")
                and f"{name.removesuffix('.idl')}{kind}" not in names
                and not exclude.has(str(inside / name))
            ]
    return sorted(unread)


#: When a file was written and last changed, its size and its number: all 0 if there is none.
Stamp: TypeAlias = tuple[int, int, int, int]
#: Nanoseconds; changes within a tick of a file system's clock may have the same time.
TICK = 20_000_000
_NO_FILE = (0, 0, 0, 0)
_UNKNOWN = (-1, 0, 0, 0)


def snapshot(paths: Iterable[str], include: Iterable[str], root: Root) -> dict[str, Stamp]:
    """Return the stamp of each input file, of its package.xml and of files along -I."""
    files = [file.path for file in list_files((*paths, *include), root, Report()).files]
    manifests = {path.parent.parent / MANIFEST for path in files}
    return stamps((*files, *sorted(manifests)))


def stamps(paths: Iterable[Path]) -> dict[str, Stamp]:
    """Return the stamp of each file or folder."""
    return {path.as_posix(): _stamp(path) for path in paths}


class DiskSnapshot:
    """The stamps of folders before they were listed, and of files when they were read.

    All paths are absolute. Reading began at a time in nanoseconds.
    """

    def __init__(
        self, folders: Mapping[Path, os.stat_result], files: Iterable[Path], begun: int
    ) -> None:
        now = time.time_ns()
        stamps = {path: _stamp_of(status) for path, status in folders.items()}
        stamps |= {path: _stamp(path) for path in files}
        for path, (written, changed, *_) in stamps.items():
            # it may have changed again since it was read, within the same tick
            if any(begun - TICK <= at <= now for at in (written, changed)):
                stamps[path] = _UNKNOWN
        self._stamps = stamps

    def is_current(self) -> bool:
        """Return whether all of them are certainly unchanged."""
        return all(stamp == _stamp(path) for path, stamp in self._stamps.items())


def _stamp(path: Path) -> Stamp:
    try:
        return _stamp_of(path.stat())
    except (OSError, ValueError):
        return _NO_FILE


def _stamp_of(status: os.stat_result) -> Stamp:
    return status.st_mtime_ns, status.st_ctime_ns, status.st_size, status.st_ino
