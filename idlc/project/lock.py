"""idlc.lock: the inputs and outputs of a run, by which the next run recognizes idlc's own files.

The file is JSON, sorted and indented, and holds nothing specific to the machine.
"""

from __future__ import annotations

import contextlib
import os
import re
import stat
from collections.abc import Iterable
from pathlib import Path
from typing import Literal, NamedTuple, TypeAlias, TypeVar

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.text import one_line
from idlc.model.ir import TypeName
from idlc.model.names import is_package_name
from idlc.project.files import content, is_file, kind_of, read_bytes, reason

#: A path of a file that idlc may have written below a folder: a few plain names.
_OWN = re.compile(r"(?:[\w-][\w.-]*/){0,7}[\w-][\w.-]*", re.ASCII)


def may_be_own(path: str) -> bool:
    """Return whether idlc may have written a file of this path; it does not leave its folder.

    The path is from a record of unknown origin.
    """
    return len(path) < 1000 and _OWN.fullmatch(path) is not None


class Obstacle(NamedTuple):
    """An obstacle to writing a file: a link or folder in its place, or an unreadable file."""

    what: str


class Tree:
    """A folder's files by relative path. Each folder in it is examined once."""

    def __init__(self, root: Path) -> None:
        self._root = str(root)
        self._folders: dict[str, Obstacle | bool] = {"": True}

    def read(self, path: str) -> bytes | Obstacle | None:
        """Return a file's content, the obstacle in its place, or `None` if there is nothing."""
        folder = self._folder(path.rpartition("/")[0])
        if folder is not True:
            return folder or None
        whole = f"{self._root}/{path}"
        try:
            status = os.lstat(whole)
            if stat.S_ISREG(status.st_mode):
                return content(whole, status.st_size)
            return Obstacle(_is(path, status.st_mode))
        except FileNotFoundError:
            return None
        except OSError as error:
            return Obstacle(f"`{path}` cannot be read: {reason(error)}")

    def renamed(self, old: Iterable[str], new: Iterable[str]) -> dict[str, str]:
        """Return the new names of old files that differ from them in capitals only.

        Both are one file where the file system ignores case, as on Windows and macOS.
        """
        names = {path.casefold(): path for path in new}
        pairs = ((path, names.get(path.casefold())) for path in old)
        return {path: name for path, name in pairs if name and self._is_one(path, name)}

    def _is_one(self, path: str, other: str) -> bool:
        try:
            first, second = (os.lstat(f"{self._root}/{name}") for name in (path, other))
        except OSError:
            return False
        return path != other and os.path.samestat(first, second)

    def _folder(self, path: str) -> Obstacle | bool:
        """Return whether a folder exists, or the obstacle in its place or above it."""
        if path not in self._folders:
            status = self._folder(path.rpartition("/")[0])
            if status is True:
                try:
                    mode = os.lstat(f"{self._root}/{path}").st_mode
                    status = stat.S_ISDIR(mode) or Obstacle(_is(path, mode))
                except FileNotFoundError:
                    status = False
                except OSError as error:
                    status = Obstacle(f"`{path}` cannot be read: {reason(error)}")
            self._folders[path] = status
        return self._folders[path]


def _is(path: str, mode: int) -> str:
    if stat.S_ISLNK(mode):
        return f"`{path}` is a symbolic link"
    return f"`{path}` is {'a file' if stat.S_ISREG(mode) else kind_of(mode)}"


_Content = TypeVar("_Content")

FILE = "idlc.lock"
#: The file beside it by which builds without idlc notice that classes are out of date.
BUILD_STEP = "_idlc_build.py"
#: Raised when an older idlc could not read what a newer one writes.
FORMAT = 1


class _Header(msgspec.Struct):
    format: int
    idlc: str


#: How a package has its runtime: as a copy of its own, or from the distribution idlc-runtime.
Runtime: TypeAlias = Literal["carried", "installed"]
#: The place of the types of other packages that are used: in the generated package, as whole
#: packages beside it, or where they are installed.
Vendoring: TypeAlias = Literal["private", "beside", ""]


class Lock(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The record of one generated package.

    `inputs` are the compiled files by name within the package, `dependencies` the other
    interfaces that were read, by full name, `outputs` the files written, by path below the
    lock: each with a SHA-256. `types` are the package's type hashes. `imports` are the modules of
    other packages that the generated code needs, `vendored` the packages written beside it.
    `converts_values` is set where the classes convert values as in Lyrical, `enums` where they
    have enums for all fields.
    """

    format: int
    idlc: str
    package: str
    runtime: Runtime = "carried"
    vendor_deps: bool = False
    enums: bool = False
    converts_values: bool | msgspec.UnsetType = msgspec.UNSET
    vendored: tuple[str, ...] = ()
    imports: tuple[str, ...] = ()
    inputs: dict[str, str]
    dependencies: dict[str, str] = {}
    types: dict[str, str]
    outputs: dict[str, str]

    @property
    def vendoring(self) -> Vendoring:
        """The place of other packages' types."""
        if not self.vendor_deps:
            return ""
        return "beside" if self.vendored else "private"

    def vendors_as(self, vendoring: Vendoring) -> bool:
        """Return whether a run that vendors in this way would write the same files."""
        if self.vendor_deps and not self.dependencies:  # the places differ for nothing
            return bool(vendoring)
        return self.vendoring == vendoring


def digest(data: bytes) -> str:
    """Return the SHA-256 of a file, for a text with line ends normalized.

    On Windows, git checks texts out with other ones.
    """
    import hashlib  # loads OpenSSL, which a check does without

    return hashlib.sha256(_plain(data)).hexdigest()


def is_same(old: bytes | None, new: bytes | None) -> bool:
    """Return whether a file has a content already, with any line ends."""
    return old == new or (old is not None and new is not None and _plain(old) == new)


def _plain(data: bytes) -> bytes:
    if b"\r" not in data or b"\0" in data:  # one byte is found much faster than two
        return data
    return data.replace(b"\r\n", b"\n")


def meaning(text: str, package: str) -> str:
    """Return a SHA-256 of an interface's text that ignores its comments and spelling.

    Dependencies are recorded by it: the built-in catalogue has no comments and spells out what
    an installed package abbreviates, and both compile to the same.
    """
    constants: list[str] = []
    fields: list[str] = []
    for line in text.splitlines():
        code = line.partition("#")[0].replace("\t", " ").rstrip()
        kind, _, rest = code.removeprefix(f"{package}/").partition(" ")
        name, sign, value = rest.lstrip(" ").partition("=")
        if sign:
            constants.append(f"{kind} {name.rstrip(' ')}={_value(kind, value.strip(' '))}")
        elif code:
            name, _, value = name.partition(" ")
            fields.append(f"{kind} {name} {_value(kind, value.strip(' '))}")
        if kind.startswith("---"):
            constants.append(kind)
    return digest("\n".join((*constants, *fields)).encode())


def _value(kind: str, text: str) -> str:
    if kind in ("float32", "float64"):
        with contextlib.suppress(ValueError):
            return repr(float(text))
    return text.lower() if kind == "bool" else text


def encode(lock: Lock) -> bytes:
    """Return the content of the file."""
    return msgspec.json.format(msgspec.json.encode(lock, order="sorted"), indent=2) + b"\n"


def load_lock(out: Path, name: str, report: Report, again: str = "idlc gen") -> Lock | None:
    """Return the lock of a generated package, `None` if it has none; report IDL615.

    `again` is the command for hints that writes the package.
    """
    path = out / FILE
    if not is_file(path):
        return None
    shown = f"{name}/{FILE}"
    data = read_bytes(path, shown, report)
    if data is None:
        return None
    try:
        return decode(data)
    except ValueError as error:
        why = one_line(str(error))
        hint = "upgrade idlc"
        if "newer" not in why:
            hint = (
                f"restore it from version control, or run `{again} --force`, which keeps a copy "
                "of every file that it replaces"
            )
        report.add(codes.BAD_LOCK.of(shown, f"`{shown}` is unusable: {why}", hint=hint))
        return None


def _decoded(data: bytes, kind: type[_Content]) -> _Content:
    try:
        return msgspec.json.decode(data, type=kind)
    except RecursionError as error:
        raise ValueError("it is nested too deeply") from error
    except msgspec.MsgspecError as error:  # no ValueError in older versions
        raise ValueError(str(error)) from error


def _decline_newer(read: _Header | Lock) -> None:
    if read.format > FORMAT:
        raise ValueError(f"it was written by idlc {read.idlc}, which is newer than this version")


def decode(data: bytes) -> Lock:
    """Return a lock from a file's content; raise ValueError for one that cannot be used."""
    try:
        lock = _decoded(data, Lock)
    except ValueError:
        _decline_newer(_decoded(data, _Header))
        raise
    _decline_newer(lock)
    for path in lock.outputs:
        if not may_be_own(path):
            raise ValueError(f"it lists a file that idlc cannot have written: {path}")
    names = [*lock.types, *(name.replace(".", "/") + "/X" for name in lock.imports)]
    names += [f"{package}/msg/X" for package in lock.vendored]
    for name in names:
        if not is_package_name(TypeName.parse(name).package):
            raise ValueError(f"it contains an invalid package name: {name}")
    return lock
