"""Reading one file: bytes within a limit, and bytes as source text.

A problem with a file is reported and `None` returned; nothing is raised. Only regular files
are opened, so that no pipe or device can hold the run up.
"""

from __future__ import annotations

import errno
import os
import re
import stat
import sys
from functools import cache
from pathlib import Path

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report
from idlc.diagnostics.source import Source, Span
from idlc.diagnostics.text import closest


@cache
def cache_folder() -> Path | None:
    """Return this user's folder of idlc's caches, made if need be; `None` if nothing can be kept.

    Its content is executed. So it is only used where nobody else can write.
    """
    base = _base()
    if base is None:
        return None
    place = base / "idlc"
    try:
        existing = next(folder for folder in (place, *place.parents) if folder.exists())
        if not _is_ours(existing):  # `sudo idlc` leaves nothing in another user's home
            return None
        place.mkdir(mode=0o700, parents=True, exist_ok=True)
        # on Windows, modes do not show who may write
        is_open = sys.platform != "win32" and place.stat().st_mode & 0o022
        private = _is_ours(place) and not is_open
        return place if private and os.access(place, os.W_OK) else None
    except OSError:
        return None


def _base() -> Path | None:
    """Return the folder for caches on this system."""
    if sys.platform == "win32":
        setting = os.environ.get("LOCALAPPDATA", "")
    else:
        setting = os.environ.get("XDG_CACHE_HOME", "")
    if Path(setting).is_absolute():
        return Path(setting)
    try:
        home = Path.home()
    except RuntimeError:
        return None
    return home / ("Library/Caches" if sys.platform == "darwin" else ".cache")


def _is_ours(path: Path) -> bool:
    return sys.platform == "win32" or path.stat().st_uid == os.getuid()


#: Bytes; the largest interface file that is read. Real ones stay below 64 KiB.
MAX_SIZE = 16 << 20
#: Lines of one file; each costs memory, however short it is.
MAX_LINES = 500_000
_LINE_ENDS = "\n\r\x0b\x0c\x1c\x1d\x1e\x85\u2028\u2029"

_SPECIAL = {
    stat.S_IFIFO: "a named pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFDIR: "a folder",
}

_READING = os.O_RDONLY | getattr(os, "O_BINARY", 0)
#: The byte order marks of UTF-16.
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")


def is_file(path: str | Path) -> bool:
    """Return whether a path leads to a regular file; a path that cannot be looked at does not."""
    return os.path.isfile(path)  # noqa: PTH113 - Path.is_file() raises


def is_folder(path: Path) -> bool:
    """Return whether a path leads to a folder; a path that cannot be looked at does not."""
    return os.path.isdir(path)  # noqa: PTH112 - Path.is_dir() raises


def entries(folder: Path) -> list[Path]:
    """Return what is in a folder, sorted; nothing if it cannot be listed."""
    try:
        return [folder / name for name in sorted(os.listdir(folder))]  # noqa: PTH208 - compares fast
    except (OSError, ValueError):
        return []


def reason(error: OSError | ValueError) -> str:
    """Return the operating system's message, without number and path."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror[:1].lower() + error.strerror[1:]
    return str(error)


def kind_of(mode: int) -> str:
    """Return a description of a file that is not regular, such as `a named pipe`."""
    return _SPECIAL.get(stat.S_IFMT(mode), "a special file")


def read_bytes(path: Path, name: str, report: Report) -> bytes | None:
    """Return a regular file's bytes; report IDL601, IDL604 or IDL605 and return `None` else."""
    try:
        status = os.stat(path)  # noqa: PTH116 - a Path's takes as long again
        if not stat.S_ISREG(status.st_mode):
            report.add(codes.NOT_AN_INTERFACE.of(name, f"`{name}` is {kind_of(status.st_mode)}"))
            return None
        if status.st_size <= MAX_SIZE:
            data = content(path, status.st_size, MAX_SIZE + 1)
            if len(data) <= MAX_SIZE:
                return data
    except (OSError, ValueError) as error:
        report.add(unreadable(name, path, error))
        return None
    report.add(too_large(name))
    return None


def content(path: str | Path, size: int, most: int = sys.maxsize) -> bytes:
    """Return a file's content, at most `most` bytes; `size` is the expected length.

    The layers above the system's calls would take half of the time.
    """
    handle = os.open(path, _READING)
    try:
        data = os.read(handle, size + 1)
        while len(data) != size and (more := os.read(handle, min(1 << 20, most - len(data)))):
            data += more
        return data
    finally:
        os.close(handle)


def too_large(name: str) -> Diagnostic:
    """Return the problem with a file of more than `MAX_SIZE` bytes."""
    message = f"`{name}` is larger than {MAX_SIZE >> 20} MiB, the limit for interface files"
    hint = "check that this is an interface file"
    return codes.TOO_LARGE.of(name, message, hint=hint)


def leading_out(name: str) -> Diagnostic:
    """Return the problem with a link of a git repository that leads out of it."""
    message = f"idlc does not follow `{name}`, a link that leads out of its git repository"
    hint = "replace the link with what it leads to, or remove it from the repository"
    return codes.UNREADABLE.of(name, message, hint=hint)


def unreadable(name: str, place: Path, error: OSError | ValueError) -> Diagnostic:
    """Return the problem with a path that cannot be read."""
    if isinstance(error, OSError) and error.errno == errno.ENOENT:
        return missing(name, place)
    return codes.UNREADABLE.of(name, f"cannot read `{name}`: {reason(error)}")


def missing(name: str, place: Path) -> Diagnostic:
    """Return IDL602 for a path that leads nowhere."""
    message = f"no such file or folder: `{name}`"
    return codes.NO_SUCH_PATH.of(name, message, hint=near_path(name, place))


#: The hint where the word of `idlc breaking --against` takes the place of an address or a path.
GRAPH_HINT = (
    "`idlc show dds` lists what running nodes use, and `idlc breaking --against graph` compares it"
)


def near_path(name: str, place: Path) -> str | None:
    """Return the hint for a path that leads nowhere, such as the closest one that exists."""
    if address := re.fullmatch(r"(tcp|udp|tls|quic|ws)://(.+)", name):
        return f"for a robot, write `{address[1]}/{address[2]}`"
    path = Path(name)
    shown, parts = Path(path.anchor), path.relative_to(path.anchor).parts
    folder = Path(*place.parts[: -len(parts)])
    for part in parts:
        near: str | None = part
        if not os.path.lexists(folder / part):
            near = closest(part, [entry.name for entry in entries(folder)])
        if near is None:
            return GRAPH_HINT if name == "graph" else None
        shown, folder = shown / near, folder / near
    return f"did you mean `{shown.as_posix()}`?"


def decode(data: bytes, name: str, report: Report) -> Source | None:
    """Return bytes as source text, unchanged; report IDL603 where they are not UTF-8, IDL604."""
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        report.add(_not_text(data, name, error.start))
        return None
    if sum(map(text.count, _LINE_ENDS)) <= MAX_LINES:
        return Source(name, text)
    message = f"`{name}` has more than {MAX_LINES:,} lines, too many for an interface file"
    report.add(codes.TOO_LARGE.of(name, message, hint="split it up"))
    return None


def _not_text(data: bytes, name: str, offset: int) -> Diagnostic:
    hint = "save the file as UTF-8"
    if data.startswith(_UTF_16):
        return codes.NOT_TEXT.of(name, "this is UTF-16, not UTF-8", hint=hint)
    byte, number = f"0x{data[offset]:02X}", offset + 1
    if b"\0" in data[:4096]:
        message = f"this is a binary file: byte {number} is {byte}, not UTF-8 text"
        return codes.NOT_TEXT.of(name, message)
    start = len(data[:offset].decode("utf-8"))
    span = Span(Source(name, data.decode("utf-8", errors="replace")), start, start + 1)
    message = f"byte {byte} is not UTF-8 (byte {number} of the file)"
    return codes.NOT_TEXT.at(span, message, hint=hint)


def read_source(path: Path, name: str, report: Report) -> Source | None:
    """Return a file as source text; report an obstacle and return `None` else."""
    data = read_bytes(path, name, report)
    return None if data is None else decode(data, name, report)
