"""Copying what is at many places of a buffer, with as few operations as possible."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

#: From this mean size on, ranges are copied one by one.
LONG = 256
VERY_LONG = 1 << 16
#: Up to this largest size, ranges are cut out of windows that are all as wide.
SHORT = 32


def window(buffer: Any, dtype: Any) -> Any:
    """Return an array of what begins at each byte of a buffer."""
    dtype = np.dtype(dtype)
    count = max(0, len(buffer) - dtype.itemsize + 1)
    return np.ndarray((count,), dtype, buffer, strides=(1,))


def regular(starts: Any) -> int | None:
    """Return the distance of places that are all as far from each other."""
    if len(starts) < 2:
        return None
    distance = int(starts[1] - starts[0])
    return distance if (np.diff(starts) == distance).all() else None


class Place(NamedTuple):
    """Where an array is in the memory of a buffer."""

    buffer: Any
    offset: int
    shape: tuple[int, ...]
    strides: tuple[int, ...]


def blocks(buffer: Any, starts: Any, size: int) -> Place:
    """Return where as many bytes from each start are, which may be in the buffer itself."""
    distance = regular(starts)
    if distance is not None and distance >= size:
        return Place(buffer, int(starts[0]), (len(starts),), (distance,))
    if size > VERY_LONG:
        rows = _one_by_one(buffer, starts, np.full(len(starts), size))
    else:
        rows = window(buffer, f"V{size}")[starts].view(np.uint8)
    return Place(rows, 0, (len(starts),), (size,))


def rows_of(buffer: Any, starts: Any, counts: Any, item: int) -> Place | None:
    """Return where as many items from each start are; None if they are not as many."""
    if not len(counts) or (counts != counts[0]).any():
        return None
    count = int(counts[0])
    place = (
        blocks(buffer, starts, count * item)
        if count
        else Place(b"", 0, (len(counts),), (0,))
    )
    return place._replace(shape=(*place.shape, count), strides=(*place.strides, item))


def ranges(buffer: Any, starts: Any, sizes: Any, item: int = 1) -> Any:
    """Return bytes, so many from each start, one after the other.

    All sizes are multiples of `item`.
    """
    total = int(sizes.sum())
    longest = int(sizes.max()) if total else 0
    if not total:
        return np.empty(0, np.uint8)
    if total >= LONG * len(sizes):
        return _one_by_one(buffer, starts, sizes)
    if longest <= SHORT and (starts + longest <= len(buffer)).all():
        rows: Any = window(buffer, f"V{longest}")[starts]
        inside = np.arange(longest) < sizes[:, None]
        return rows.view(np.uint8).reshape(-1, longest)[inside]
    counts = sizes // item
    shift = starts - (np.cumsum(counts) - counts) * item
    places = np.repeat(shift, counts)
    places += np.arange(len(places)) * item
    items: Any = window(buffer, f"V{item}")[places]
    return items.view(np.uint8)


def _one_by_one(buffer: Any, starts: Any, sizes: Any) -> Any:
    result: Any = np.empty(int(sizes.sum()), np.uint8)
    target, source = memoryview(result), memoryview(buffer)
    at = 0
    for start, size in zip(starts.tolist(), sizes.tolist(), strict=True):
        end = at + size
        target[at:end] = source[start : start + size]
        at = end
    return result
