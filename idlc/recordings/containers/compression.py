"""Decompression, bounded by what a chunk declares, by libraries that it alone imports."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from typing import Any

from idlc.recordings.containers.source import RecordingError

#: Decompressors that return new bytes return this many at a time.
PIECE = 1 << 22
#: A chunk may not be larger, whatever it says: no writer makes chunks that come near.
MOST_IN_A_CHUNK = 1 << 29
#: How many times larger than the file all that is compressed in it may be, and how much in any
#: case: images that are all black come near.
MOST_GROWTH, ANY_GROWTH = 10_000, MOST_IN_A_CHUNK
#: How many records there may be for each byte of a file, and in any case.
MOST_RECORDS, ANY_RECORDS = 2, 1 << 20
#: Holds the zstd decompressor of a thread: a new one for each chunk would add a tenth of the
#: time, and threads cannot share one.
_THREAD = threading.local()
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"


def check_size(size: int) -> None:
    """Raise RecordingError if a chunk declares more bytes than a chunk may have."""
    if size > MOST_IN_A_CHUNK:
        raise RecordingError(f"a chunk declares {size:,} bytes, more than {MOST_IN_A_CHUNK:,}")


class Room:
    """The bytes and records that a file may still decompress to, so that reading stays linear."""

    def __init__(self, size: int) -> None:
        self._bytes = ANY_GROWTH + MOST_GROWTH * size
        self._records = ANY_RECORDS + MOST_RECORDS * size

    def reserve(self, size: int) -> None:
        """Reserve room for so many bytes; raise RecordingError if there is none."""
        check_size(size)
        self._bytes -= size
        if self._bytes < 0:
            what = f"more than {MOST_GROWTH:,} times as much as the file"
            raise RecordingError(f"what is compressed in it holds {what}")

    def records(self) -> Iterator[None]:
        """Yield for each record for which there is room; raise RecordingError after the last."""
        while self._records > 0:
            self._records -= 1
            yield
        raise RecordingError(f"it has more than {MOST_RECORDS} records for each of its bytes")


def decompress(data: memoryview, compression: str, target: memoryview) -> None:
    """Decompress a chunk into `target`; raise RecordingError if the content has another size."""
    size = _decompressor(compression)(data, target) if compression else _copy(data, target)
    if size != len(target):
        more = "more" if size > len(target) else f"{size:,}"
        raise RecordingError(f"a chunk declares {len(target):,} bytes and holds {more}")


#: Decompresses bytes into a buffer, and returns their number: one more than the buffer's size if
#: they do not fit.
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
    """Decompress by a stream, which writes into a buffer; one call would allocate each chunk."""
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
    """Decompress a message that is compressed by itself and declares its size."""
    size = _declared(data)
    room.reserve(size)
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
        piece: bytes
        piece, read, self.eof = self._piece(self._context, rest, max_length=max_length)
        self._rest = rest[read:]
        self.needs_input = len(piece) < max_length
        return piece


def _by_pieces(decompressor: Any, data: memoryview, target: memoryview) -> int:
    """Decompress one frame, so that never more than a piece is in memory twice."""
    rest, done = data, 0
    while done <= len(target):
        room = min(PIECE, len(target) - done + 1)
        piece = decompressor.decompress(rest, max_length=room)
        size = min(len(piece), len(target) - done)
        target[done : done + size] = piece[:size]
        done += len(piece)
        rest = memoryview(b"")
        if decompressor.eof or decompressor.needs_input:
            break
    return done


def missing(library: str, why: str) -> RecordingError:
    """Return the error that says how to install what is missing."""
    return RecordingError(
        f"{why}, and {library} is not installed", "pip install 'idlc[recordings]'"
    )
