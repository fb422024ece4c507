"""The bytes of a file, wherever it is: mapped into memory, or read in ranges."""

from __future__ import annotations

import mmap
import threading
from pathlib import Path
from typing import Any, Protocol

from idlc.recordings.errors import RecordingError


class Source(Protocol):
    """A file that does not change."""

    name: str
    size: int
    #: The whole file, if it is read where it is.
    mapped: memoryview | None

    def view(self, start: int, size: int) -> memoryview:
        """Return so many bytes; raise RecordingError if the file has fewer."""

    def forget(self, start: int, stop: int) -> None:
        """Let memory go in which bytes were kept; views of them read these again."""

    def close(self) -> None:
        """Release the file; views that somebody holds stay valid."""


class MappedFile:
    """A local file, of which nothing is copied."""

    def __init__(self, path: Path) -> None:
        self.name = str(path)
        try:
            with path.open("rb") as file:
                self.size = file.seek(0, 2)
                self._map = (
                    mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) if self.size else None
                )
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise RecordingError(f"`{path}` cannot be read: {reason}") from None
        self.mapped: memoryview | None = memoryview(self._map or b"")

    def view(self, start: int, size: int) -> memoryview:
        """Return a view of the mapped file."""
        within(self, start, size)
        assert self.mapped is not None
        return self.mapped[start : start + size]

    def forget(self, start: int, stop: int) -> None:
        """Unmap pages, or the whole of a long file would count as this process's memory."""
        first = -(-start // mmap.PAGESIZE) * mmap.PAGESIZE
        if self._map and hasattr(mmap, "MADV_DONTNEED") and first < stop:
            self._map.madvise(mmap.MADV_DONTNEED, first, stop - first)

    def close(self) -> None:
        """Forget the map, which lives as long as views of it."""
        self._map, self.mapped = None, memoryview(b"")
        self.size = 0


def is_local(place: Any) -> bool:
    """Return whether a place is a path of this machine, not a URL or a file object."""
    return isinstance(place, Path) or (isinstance(place, str) and "://" not in place)


def source_of(place: Any) -> Source:
    """Return a file at a path, at a URL that fsspec can open, or of an object that is one."""
    if is_local(place):
        return MappedFile(Path(place))
    name = _name(place)
    try:
        return OpenedFile(_opened(place), name)
    except RecordingError:
        raise
    except Exception as error:  # each kind of store raises its own
        raise RecordingError(f"`{name}` cannot be read: {_told(error)}") from None


def _opened(place: Any) -> Any:
    """Return a file object of a URL, of an fsspec file, or the one that is given."""
    if isinstance(place, str):
        try:
            import fsspec
        except ImportError:
            message = f"`{place}` is opened by fsspec, which is not installed"
            raise RecordingError(message, "pip install fsspec") from None
        place = fsspec.open(place, "rb")
    return place.open() if hasattr(place, "open") else place


def _told(error: Exception) -> str:
    """Return what an error says, or is."""
    if isinstance(error, FileNotFoundError):
        return "No such file or directory"
    return str(error) or type(error).__name__


def _name(place: Any) -> str:
    return str(getattr(place, "path", None) or getattr(place, "name", None) or place)


def first_bytes(path: Path, size: int = 16) -> bytes:
    """Return how a file begins."""
    try:
        with path.open("rb") as file:
            return file.read(size)
    except OSError as error:
        raise RecordingError(f"`{path}` cannot be read: {error.strerror}") from None


class OpenedFile:
    """A binary file object that can seek, such as fsspec's on an object store."""

    mapped: memoryview | None = None

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
                found = self._file.read(size)
        except Exception as error:  # each kind of store raises its own
            raise RecordingError(f"`{self.name}` cannot be read: {_told(error)}") from None
        if len(found) != size:
            raise RecordingError(f"`{self.name}`: {size} bytes asked for, {len(found)} came")
        return memoryview(found)

    def forget(self, start: int, stop: int) -> None:
        """Do nothing: nothing is kept."""

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def within(source: Source, start: int, size: int) -> None:
    """Raise RecordingError if a file does not have these bytes."""
    if min(start, size) < 0 or start + size > source.size:
        raise RecordingError(
            f"`{source.name}`: {size} bytes expected at byte {start}, the file has {source.size}"
        )
