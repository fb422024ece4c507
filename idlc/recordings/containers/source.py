"""The bytes of a file, wherever it is, read in ranges."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from errno import EIO
from io import FileIO
from os import fstat, path, stat_result
from pathlib import Path
from typing import Any

from idlc.diagnostics.errors import HintedError
from idlc.project.files import near_path


class RecordingError(HintedError):
    """A recording, or a part of it, cannot be read."""


class DamageError(RecordingError):
    """Some bytes of a recording are not what its writer wrote; others may be sound."""


@contextmanager
def of_file(name: str) -> Iterator[None]:
    """Have errors say which file is meant."""
    try:
        yield
    except RecordingError as error:
        if f"`{name}`" in error.message:
            raise
        raise type(error)(f"`{name}`: {error.message}", error.hint) from None


#: What is smaller is read with so much of what follows, which is mostly wanted next.
BLOCK = 1 << 14


class FileSource:
    """A file that may grow, and otherwise does not change.

    A local one is opened whenever it is read: a recording may have thousands of files. It is not
    mapped into memory, because truncating a mapped file kills the process. Others are URLs that
    fsspec can open, its files, and binary file objects that can seek.
    """

    def __init__(self, place: Any) -> None:
        self.is_local = is_local(place)
        self._path = Path(place).absolute() if self.is_local else None
        self._identity: stat_result | None = None
        self._block = (0, memoryview(b""))
        self._held = threading.local()
        self._lock = threading.RLock()
        if self.is_local:
            self.name = str(Path(place))
        else:
            name = getattr(place, "path", None) or getattr(place, "name", None)
            self.name = str(name or place)
            with self._errors():
                self._object = _opened(place)
        with self.opened() as file, self._errors():
            self.size = int(file.seek(0, 2))

    @contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            yield
        except RecordingError:
            raise
        except Exception as error:  # each kind of store raises its own
            reason = (self.is_local and getattr(error, "strerror", None)) or str(error)
            if isinstance(error, FileNotFoundError):
                reason = "No such file or directory"
            if isinstance(error, AttributeError):
                reason = "it is not a path, a URL or an open file"
            reason = reason or type(error).__name__
            is_damage = self.is_local and getattr(error, "errno", None) == EIO
            kind = DamageError if is_damage else RecordingError
            raise kind(f"`{self.name}` cannot be read: {reason}") from None

    @contextmanager
    def opened(self) -> Iterator[Any]:
        """Hold the file open; within this context, a thread opens a local one only once."""
        if self._path is None:
            with self._lock:
                yield self._object
            return
        if file := getattr(self._held, "file", None):
            yield file
            return
        with self._errors():
            file = FileIO(self._path)
        with file:
            now = fstat(file.fileno())
            self._identity = then = self._identity or now
            # some file systems number their files anew
            if not (path.samestat(now, then) or now.st_mtime_ns == then.st_mtime_ns):
                raise RecordingError(f"`{self.name}` was replaced while it was read")
            self._held.file = file
            try:
                yield file
            finally:
                self._held.file = None

    def read(self, start: int, target: memoryview) -> None:
        """Fill a buffer with the bytes from an offset on, all of which the file must still have."""
        self.check(start, len(target))
        done = 0
        with self.opened() as file, self._errors():
            file.seek(start)
            while done < len(target):
                if self.is_local:
                    size = file.readinto(target[done:])
                else:  # an object need not have more than `read`
                    data = file.read(len(target) - done)
                    size = len(data)
                    target[done : done + size] = data
                if not size:
                    why = f"it was cut off at byte {start + done} while it was read"
                    raise RecordingError(f"`{self.name}` cannot be read: {why}")
                done += size

    def view(self, start: int, size: int) -> memoryview:
        """Return bytes from the file, or from the block of a local one that was read last."""
        first, block = self._block
        if not first <= start <= start + size <= first + len(block):
            self.check(start, size)
            ahead = min(BLOCK, self.size - start) if self.is_local else 0
            target = memoryview(bytearray(max(size, ahead)))
            self.read(start, target)
            first, block = start, target.toreadonly()
            if size < BLOCK:
                self._block = first, block
        return block[start - first : start - first + size]

    def check(self, start: int, size: int) -> None:
        """Raise RecordingError if the file does not have these bytes."""
        if min(start, size) < 0 or start + size > self.size:
            raise DamageError(
                f"`{self.name}`: {size} bytes expected at byte {start}, the file has {self.size}"
            )

    def check_unchanged(self) -> None:
        """Raise RecordingError if a local file is not as it was when it was first opened."""
        if self._path is None or self._identity is None:
            return
        with self._errors():
            now, then = self._path.stat(), self._identity
        if (now.st_mtime_ns, now.st_size) != (then.st_mtime_ns, then.st_size):
            raise RecordingError(f"`{self.name}` was changed while it was read", "read it again")

    def close(self) -> None:
        """Release the file; views stay valid."""
        if not self.is_local:
            self._object.close()


def is_local(place: Any) -> bool:
    """Return whether a place is a path of this machine, not a URL or a file object."""
    return isinstance(place, Path) or (isinstance(place, str) and "://" not in place)


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


def first_bytes(path: Path, size: int = 16) -> bytes:
    """Return the first bytes of a file."""
    try:
        with path.open("rb") as file:
            return file.read(size)
    except OSError as error:
        is_missing = isinstance(error, FileNotFoundError)
        hint = near_path(str(path), path.absolute()) if is_missing else None
        raise RecordingError(f"`{path}` cannot be read: {error.strerror}", hint) from None
