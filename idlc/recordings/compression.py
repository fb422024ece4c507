"""Decompression, bounded by what a chunk declares, by libraries that it alone imports."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from idlc.recordings.errors import RecordingError

#: A chunk may not be larger, whatever it says: no writer makes chunks that come near.
MOST_IN_A_CHUNK = 1 << 29
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"


def decompressed(data: memoryview, compression: str, size: int) -> memoryview:
    """Return the `size` bytes that a chunk declares; raise RecordingError if it has others."""
    if size > MOST_IN_A_CHUNK:
        raise RecordingError(f"a chunk declares {size:,} bytes, more than {MOST_IN_A_CHUNK:,}")
    if not compression or not size:
        found: Any = data
    else:
        found = _decompressor(compression)(data, size)
    if len(found) != size:
        raise RecordingError(f"a chunk declares {size:,} bytes and holds {len(found):,}")
    return memoryview(found)


def _decompressor(compression: str) -> Callable[[memoryview, int], bytes]:
    match compression:
        case "zstd":
            return _newer_zstd if sys.version_info >= (3, 14) else _zstd
        case "lz4":
            return _lz4
    raise RecordingError(f"the compression `{compression}` is not known, only zstd and lz4")


def _zstd(data: memoryview, size: int) -> bytes:
    try:
        import zstandard
    except ImportError:
        raise missing("zstandard", "chunks are compressed with zstd") from None
    try:
        # the size that the frame declares is what would be allocated
        declared = zstandard.frame_content_size(data)
        if declared > size:
            raise RecordingError(f"a chunk declares {size:,} bytes and holds {declared:,}")
        return zstandard.ZstdDecompressor().decompress(data, max_output_size=size)
    except zstandard.ZstdError as error:
        raise RecordingError(f"a chunk cannot be decompressed: {error}") from None


def _newer_zstd(data: memoryview, size: int) -> bytes:
    from compression import zstd  # type: ignore[import-not-found] # Python 3.14

    try:
        found: bytes = zstd.ZstdDecompressor().decompress(data, max_length=size + 1)
    except zstd.ZstdError as error:
        raise RecordingError(f"a chunk cannot be decompressed: {error}") from None
    return found


def _lz4(data: memoryview, size: int) -> bytes:
    try:
        from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]
    except ImportError:
        raise missing("lz4", "chunks are compressed with lz4") from None
    try:
        found: bytes = LZ4FrameDecompressor().decompress(data, max_length=size + 1)
    except (RuntimeError, ValueError, EOFError) as error:
        raise RecordingError(f"a chunk cannot be decompressed: {error}") from None
    return found


def missing(library: str, why: str) -> RecordingError:
    """Return the error that says how to install what is missing."""
    return RecordingError(
        f"{why}, and {library} is not installed", "pip install 'idlc[recordings]'"
    )
