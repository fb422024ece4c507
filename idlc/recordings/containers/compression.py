"""Decompression, bounded by what a chunk declares, by libraries that it alone imports."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from typing import Any

from idlc.recordings.containers.source import RecordingError

#: What hands out new bytes does so for this many at a time.
PIECE = 1 << 22
#: A chunk may not be larger, whatever it says: no writer makes chunks that come near.
MOST_IN_A_CHUNK = 1 << 29
#: How many times larger than the file all that is compressed in it may be, and how much in any
#: case: images that are all black come near.
MOST_GROWTH, ANY_GROWTH = 10_000, MOST_IN_A_CHUNK
#: How many records there may be for each byte of a file, and in any case.
MOST_RECORDS, ANY_RECORDS = 2, 1 << 20
#: Has one decompressor of zstd: making one for each chunk takes a tenth of the time, and threads
#: cannot share it.
_THREAD = threading.local()
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"


def check_size(size: int) -> None:
    """Raise RecordingError if a chunk declares more than there is room for."""
    if size > MOST_IN_A_CHUNK:
        raise RecordingError(f"a chunk declares {size:,} bytes, more than {MOST_IN_A_CHUNK:,}")


class Room:
    """How much compressed parts of a file may still hold, so that reading it takes linear time."""

    def __init__(self, size: int) -> None:
        self._bytes = ANY_GROWTH + MOST_GROWTH * size
        self._records = ANY_RECORDS + MOST_RECORDS * size

    def take(self, size: int) -> None:
        """Make room for so many bytes; raise RecordingError if there is none."""
        check_size(size)
        self._bytes -= size
        if self._bytes < 0:
            what = f"more than {MOST_GROWTH:,} times as much as the file"
            raise RecordingError(f"what is compressed in it holds {what}")

    def each(self) -> Iterator[None]:
        """Yield for each record for which there is room; raise RecordingError after the last."""
        while self._records > 0:
            self._records -= 1
            yield
        raise RecordingError(f"it has more than {MOST_RECORDS} records for each of its bytes")


def decompress(data: memoryview, compression: str, target: memoryview) -> None:
    """Write into `target` what a chunk holds; raise RecordingError if that is not its size."""
    found = _decompressor(compression)(data, target) if compression else _copy(data, target)
    if found != len(target):
        more = "more" if found > len(target) else f"{found:,}"
        raise RecordingError(f"a chunk declares {len(target):,} bytes and holds {more}")


#: Writes what compressed bytes hold into a buffer, and returns how much that is: more by one, if it
#: is more than there is room for.
Decompressor = Callable[[memoryview, memoryview], int]


def _decompressor(compression: str) -> Decompressor:
    match compression:
        case "zstd":
            return _newer_zstd if sys.version_info >= (3, 14) else _zstd
        case "lz4":
            return _lz4
    raise RecordingError(f"the compression `{compression}` is not known, only zstd and lz4")


def _copy(data: memoryview | bytes, target: memoryview) -> int:
    size = min(len(data), len(target))
    target[:size] = data[:size]
    return len(data)


def _zstd(data: memoryview, target: memoryview) -> int:
    """A stream writes where it is told to; in one call, each chunk would be new memory."""
    try:
        import zstandard
    except ImportError:
        raise missing("zstandard", "chunks are compressed with zstd") from None
    if not hasattr(_THREAD, "zstd"):
        _THREAD.zstd = zstandard.ZstdDecompressor()
    reader = _THREAD.zstd.stream_reader(data, read_across_frames=True)
    done = 0
    try:
        while done < len(target) and (size := reader.readinto(target[done:])):
            done += size
        return done + len(reader.read(1))
    except zstandard.ZstdError as error:
        raise RecordingError(f"a chunk cannot be decompressed: {error}") from None


def zstd_frame(data: bytes | memoryview, room: Room) -> bytes:
    """Return what a message holds that is compressed by itself, and says how large it is."""
    size = _declared(data)
    room.take(size)
    target = bytearray(size)
    decompress(memoryview(data), "zstd", memoryview(target))
    return bytes(target)


def _declared(data: bytes | memoryview) -> int:
    """Return the size that the head of a zstd frame declares (RFC 8878, 3.1.1.1)."""
    flags = data[4] if len(data) > 4 else 0
    single = flags >> 5 & 1
    width = (single, 2, 4, 8)[flags >> 6]
    start = 5 + (not single) + (0, 1, 2, 4)[flags & 3]
    if not width or len(data) < start + width:
        raise RecordingError("a compressed message does not declare its size")
    return int.from_bytes(data[start : start + width], "little") + (256 if width == 2 else 0)


def _newer_zstd(data: memoryview, target: memoryview) -> int:
    from compression import zstd  # type: ignore[import-not-found] # Python 3.14

    try:
        return _by_pieces(zstd.ZstdDecompressor(), data, target)
    except zstd.ZstdError as error:
        raise RecordingError(f"a chunk cannot be decompressed: {error}") from None


def _lz4(data: memoryview, target: memoryview) -> int:
    try:
        from lz4 import frame
    except ImportError:
        raise missing("lz4", "chunks are compressed with lz4") from None
    try:
        return _by_pieces(_Lz4(frame), data, target)
    except (RuntimeError, ValueError, EOFError) as error:
        raise RecordingError(f"a chunk cannot be decompressed: {error}") from None


class _Lz4:
    """Decompresses as the standard library does; lz4's own class copies its input each time."""

    def __init__(self, frame: Any) -> None:
        self._piece = frame.decompress_chunk
        self._context = frame.create_decompression_context()
        self._rest = memoryview(b"")
        self.eof = self.needs_input = False

    def decompress(self, data: memoryview, max_length: int) -> bytes:
        """Return the next bytes."""
        rest = self._rest or data
        found: bytes
        found, read, self.eof = self._piece(self._context, rest, max_length=max_length)
        self._rest = rest[read:]
        self.needs_input = len(found) < max_length
        return found


def _by_pieces(decompressor: Any, data: memoryview, target: memoryview) -> int:
    """Decompress one frame, so that never more than a piece is in memory twice."""
    rest, done = data, 0
    while done <= len(target):
        room = min(PIECE, len(target) - done + 1)
        found = decompressor.decompress(rest, max_length=room)
        size = min(len(found), len(target) - done)
        target[done : done + size] = found[:size]
        done += len(found)
        rest = memoryview(b"")
        if decompressor.eof or decompressor.needs_input:
            break
    return done


def missing(library: str, why: str) -> RecordingError:
    """Return the error that says how to install what is missing."""
    return RecordingError(
        f"{why}, and {library} is not installed", "pip install 'idlc[recordings]'"
    )
