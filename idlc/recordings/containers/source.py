"""The bytes of a file, wherever it is, read in ranges."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from io import FileIO
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeAlias


class RecordingError(Exception):
    """A recording, or a part of it, cannot be read; `hint` says what can be done about it."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message, hint)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message} ({self.hint})" if self.hint else self.message


@contextmanager
def of_file(name: str) -> Iterator[None]:
    """Have errors say which file is meant."""
    try:
        yield
    except RecordingError as error:
        if f"`{name}`" in error.message:
            raise
        raise RecordingError(f"`{name}`: {error.message}", error.hint) from None


#: How ROS 2 writes messages.
CDR = "cdr"
#: So many bytes suffice.
START = 6
#: By the encapsulation header without its last bit, which is the byte order (RTPS 2.5, 10.2).
_ENCAPSULATIONS = {
    b"\x00\x02": "PL_CDR (XCDR1)",
    b"\x00\x06": "PLAIN_CDR2 (XCDR2)",
    b"\x00\x08": "DELIMITED_CDR2 (XCDR2)",
    b"\x00\x0a": "PL_CDR2 (XCDR2)",
}
#: Compressions by what they begin with; CDR begins with a zero.
_COMPRESSIONS = {
    b"\x04\x22\x4d\x18": "lz4",
    b"\x1f\x8b": "gzip",
    b"BZh": "bzip2",
    b"\xfd7zXZ\x00": "xz",
}


class UnreadTopic(NamedTuple):
    """Why the messages of a topic cannot be read, and what can be done about it."""

    message: str
    hint: str


def unread_reason(topic: str, start: bytes) -> UnreadTopic | None:
    """Return why messages that begin so cannot be read, or None if no such reason is known."""
    kind = _ENCAPSULATIONS.get(bytes((start[0], start[1] & ~1))) if len(start) > 1 else None
    if kind:
        what = f"messages of `{topic}` are written as {kind}, and idlc reads only plain CDR"
        return UnreadTopic(what, "record them from a publisher whose data representation is XCDR1")
    for magic, name in _COMPRESSIONS.items():
        if start.startswith(magic):
            what = (
                f"messages of `{topic}` are each compressed with {name}, and idlc reads only zstd"
            )
            return UnreadTopic(what, "`ros2 bag convert` can write the bag without compression")
    return None


#: What is smaller is read with so much of what follows, which is mostly wanted next.
BLOCK = 1 << 14


Read: TypeAlias = Callable[[int, memoryview], None]


class Source(Protocol):
    """A file that may grow, and otherwise does not change."""

    name: str
    size: int

    def view(self, start: int, size: int) -> memoryview:
        """Return so many bytes; raise RecordingError if the file has fewer."""

    def opened(self) -> AbstractContextManager[Read]:
        """Give a function that fills a buffer with the bytes from an offset on.

        A local file is opened once for all reads within this context.
        """

    def close(self) -> None:
        """Release the file; views stay valid."""


class LocalFile:
    """A local file, opened whenever a piece of it is read: a recording may have thousands of files.

    It is not mapped into memory, because truncating a mapped file kills the process.
    """

    def __init__(self, path: Path) -> None:
        self.name = str(path)
        self._path = path.absolute()
        self._identity: os.stat_result | None = None
        self._block = (0, memoryview(b""))
        self._held = threading.local()
        with self._file() as file, self._errors():
            self.size = file.seek(0, 2)

    @contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            yield
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise RecordingError(f"`{self.name}` cannot be read: {reason}") from None

    @contextmanager
    def _file(self) -> Iterator[FileIO]:
        """Give the open file; within this context, the same thread opens it only once."""
        if file := getattr(self._held, "file", None):
            yield file
            return
        with self._errors():
            file = FileIO(self._path)
        with file:
            now = os.fstat(file.fileno())
            self._identity = then = self._identity or now
            # some file systems number their files anew
            if not (os.path.samestat(now, then) or now.st_mtime_ns == then.st_mtime_ns):
                raise RecordingError(f"`{self.name}` was replaced while it was read")
            self._held.file = file
            try:
                yield file
            finally:
                self._held.file = None

    @contextmanager
    def opened(self) -> Iterator[Read]:
        """Give a function that fills a buffer, or fails if the file was truncated meanwhile."""
        with self._file() as file:

            def read(start: int, target: memoryview) -> None:
                within(self, start, len(target))
                done = 0
                with self._errors():
                    file.seek(start)
                    while done < len(target) and (size := file.readinto(target[done:])):
                        done += size
                if done < len(target):
                    why = f"it was cut off at byte {start + done} while it was read"
                    raise RecordingError(f"`{self.name}` cannot be read: {why}")

            yield read

    def view(self, start: int, size: int) -> memoryview:
        """Return bytes from the file, or from the block that was read last."""
        within(self, start, size)
        first, block = self._block
        if not first <= start <= start + size <= first + len(block):
            first, block = start, memoryview(bytearray(max(size, min(BLOCK, self.size - start))))
            with self.opened() as read:
                read(start, block)
            if size < BLOCK:
                self._block = first, block
        return block[start - first : start - first + size].toreadonly()

    def close(self) -> None:
        """Do nothing: the file is not open."""


def is_local(place: Any) -> bool:
    """Return whether a place is a path of this machine, not a URL or a file object."""
    return isinstance(place, Path) or (isinstance(place, str) and "://" not in place)


def source_of(place: Any) -> Source:
    """Return a file at a path, at a URL that fsspec can open, or of an object that is one."""
    if is_local(place):
        return LocalFile(Path(place))
    name = _name(place)
    try:
        return OpenedFile(_opened(place), name)
    except RecordingError:
        raise
    except Exception as error:  # each kind of store raises its own
        raise RecordingError(f"`{name}` cannot be read: {_reason(error)}") from None


def _opened(place: Any) -> Any:
    """Return a file object of a URL, of an fsspec file, or `place` itself."""
    if isinstance(place, str):
        try:
            import fsspec
        except ImportError:
            message = f"`{place}` is opened by fsspec, which is not installed"
            raise RecordingError(message, "pip install fsspec") from None
        place = fsspec.open(place, "rb")
    return place.open() if hasattr(place, "open") else place


def _reason(error: Exception) -> str:
    """Return the text of an error, or its type."""
    if isinstance(error, FileNotFoundError):
        return "No such file or directory"
    return str(error) or type(error).__name__


def _name(place: Any) -> str:
    return str(getattr(place, "path", None) or getattr(place, "name", None) or place)


def first_bytes(path: Path, size: int = 16) -> bytes:
    """Return the first bytes of a file."""
    try:
        with path.open("rb") as file:
            return file.read(size)
    except OSError as error:
        raise RecordingError(f"`{path}` cannot be read: {error.strerror}") from None


class OpenedFile:
    """A binary file object that can seek, such as fsspec's on an object store."""

    def __init__(self, file: Any, name: str) -> None:
        self.name = name
        self._file = file
        self._lock = threading.Lock()
        self.size = int(file.seek(0, 2))

    def view(self, start: int, size: int) -> memoryview:
        """Return bytes that are read now."""
        within(self, start, size)
        try:
            with self._lock:
                self._file.seek(start)
                data = self._file.read(size)
        except Exception as error:  # each kind of store raises its own
            raise RecordingError(f"`{self.name}` cannot be read: {_reason(error)}") from None
        if len(data) != size:
            raise RecordingError(f"`{self.name}`: {size} bytes asked for, {len(data)} came")
        return memoryview(data)

    @contextmanager
    def opened(self) -> Iterator[Read]:
        """Give a function that fills a buffer."""

        def read(start: int, target: memoryview) -> None:
            target[:] = self.view(start, len(target))

        yield read

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def within(source: Source, start: int, size: int) -> None:
    """Raise RecordingError if a file does not have these bytes."""
    if min(start, size) < 0 or start + size > source.size:
        raise RecordingError(
            f"`{source.name}`: {size} bytes expected at byte {start}, the file has {source.size}"
        )
