"""Compression, and decompression bounded by what a chunk declares.

It alone imports the libraries.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from idlc.recordings.containers.source import DamageError, RecordingError

#: lz4 returns new bytes, so many at a time: the system would give and take back memory for more,
#: which takes longer than decompressing.
PIECE = 1 << 16
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


class DecompressionBudget:
    """The bytes and records that a file may still decompress to, so that reading stays linear."""

    def __init__(self, size: int) -> None:
        self._bytes = ANY_GROWTH + MOST_GROWTH * size
        self._records = ANY_RECORDS + MOST_RECORDS * size

    def reserve(self, size: int) -> None:
        """Reserve room for so many bytes; raise RecordingError if there is none."""
        if size > MOST_IN_A_CHUNK:
            raise DamageError(f"a chunk declares {size:,} bytes, more than {MOST_IN_A_CHUNK:,}")
        self._bytes -= size
        if self._bytes < 0:
            what = f"more than {MOST_GROWTH:,} times as much as the file"
            raise RecordingError(f"the compressed data expands to {what}")

    def records(self) -> Iterator[None]:
        """Yield for each record for which there is room; raise RecordingError after the last."""
        while self._records > 0:
            self._records -= 1
            yield
        raise RecordingError(f"it has more than {MOST_RECORDS} records for each of its bytes")


def decompress(data: memoryview, compression: str, target: memoryview) -> None:
    """Decompress a chunk into `target`; raise RecordingError if the content has another size."""
    if compression == "zstd":
        size = _zstd(data, target)
    elif compression == "lz4":
        size = _lz4(data, target)
    elif compression:
        raise DamageError(f"unknown compression `{compression}`; idlc reads zstd and lz4")
    else:
        size = len(data)
        target[:size] = data[: len(target)]
    if size != len(target):
        more = "more" if size > len(target) else f"{size:,}"
        raise DamageError(f"a chunk declares {len(target):,} bytes and holds {more}")


def decompressed(data: memoryview, compression: str) -> bytes:
    """Return a chunk of any size that is accepted; raise DamageError if there is none."""
    if not compression:
        return bytes(data)
    if compression not in ("zstd", "lz4"):
        raise DamageError(f"unknown compression `{compression}`; idlc reads zstd and lz4")
    most, room = min(MOST_IN_A_CHUNK, MOST_GROWTH * len(data)), 16 * len(data)
    while True:  # room for all that a chunk may hold would cost more than most chunks do
        target = memoryview(bytearray(min(most, room)))
        size = _zstd(data, target) if compression == "zstd" else _lz4(data, target)
        if size <= len(target):
            return bytes(target[:size])
        if room >= most:
            raise DamageError(f"a chunk holds more than {most:,} bytes")
        room *= 16


def _zstd(data: memoryview, target: memoryview) -> int:
    """Decompress by a stream, which writes into a buffer; one call would allocate each chunk.

    Returns the number of bytes, one more than there is room for if they do not fit.
    """
    zstandard, decompressor = _zstandard()
    reader = decompressor.stream_reader(data, read_across_frames=True)
    done = 0
    try:
        while done < len(target) and (size := reader.readinto(target[done:])):
            done += size
        return done + len(reader.read(1))
    except zstandard.ZstdError as error:
        raise DamageError(f"a chunk cannot be decompressed: {error}") from None


def unpack(path: Path, target: Path) -> str | None:
    """Decompress a whole file; return why only its start can be, if that is so."""
    zstandard, decompressor = _zstandard()
    room = DecompressionBudget(path.stat().st_size)
    try:
        with path.open("rb") as source, target.open("xb") as file:
            reader = decompressor.stream_reader(source, read_across_frames=True)
            while piece := reader.read(PIECE):
                room.reserve(len(piece))
                file.write(piece)
    except zstandard.ZstdError as error:
        return f"it cannot be decompressed as a whole: {error}"
    except OSError as error:
        raise RecordingError(f"`{path}` cannot be decompressed: {error.strerror}") from None
    return None


def zstd_frame(data: bytes | memoryview, room: DecompressionBudget) -> bytes:
    """Decompress a message that is compressed by itself and declares its size."""
    zstandard, decompressor = _zstandard()
    try:
        size = zstandard.frame_content_size(data)
        if size < 0:
            raise DamageError("a compressed message does not declare its size")
        room.reserve(size)
        message: bytes = decompressor.decompress(data, allow_extra_data=False)
    except zstandard.ZstdError as error:
        raise DamageError(f"a compressed message cannot be read: {error}") from None
    return message


def _zstandard() -> tuple[Any, Any]:
    """Return the library, and the decompressor of this thread."""
    try:
        import zstandard
    except ImportError:
        raise missing("zstandard", "chunks are compressed with zstd") from None
    if not hasattr(_THREAD, "zstd"):
        _THREAD.zstd = zstandard.ZstdDecompressor()
    return zstandard, _THREAD.zstd


def _lz4(data: memoryview, target: memoryview) -> int:
    """Decompress one frame, so that never more than a piece is in memory twice.

    Returns the number of bytes, more than there is room for if they do not fit.
    """
    try:
        from lz4 import frame
    except ImportError:
        raise missing("lz4", "chunks are compressed with lz4") from None
    # the decompressor that keeps what it has not read copies it each time
    context, done, ended = frame.create_decompression_context(), 0, False
    try:
        while done <= len(target) and not ended:
            room = min(PIECE, len(target) - done + 1)
            piece, size, ended = frame.decompress_chunk(context, data, max_length=room)
            target[done : done + len(piece)] = piece[: len(target) - done]
            done += len(piece)
            data = data[size:]
            ended = ended or len(piece) < room
    except (RuntimeError, ValueError, EOFError) as error:
        raise DamageError(f"a chunk cannot be decompressed: {error}") from None
    return done


def compress(data: Any, compression: str) -> bytes:
    """Compress a chunk, or a message by itself, which then declares its size."""
    compressed: bytes
    if compression == "zstd":
        compressed = _zstandard()[0].ZstdCompressor().compress(data)
    elif compression == "lz4":
        from lz4 import frame

        compressed = frame.compress(data)
    else:
        compressed = bytes(data)
    return compressed


def missing(library: str, why: str, extra: str = "recordings") -> RecordingError:
    """Return the error that says how to install what is missing."""
    return RecordingError(f"{why}, and {library} is not installed", f"pip install 'idlc[{extra}]'")
