"""Serialized messages in memory: reading at many positions with few operations."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise, repeat
from typing import Any, NamedTuple

import numpy as np

from idlc.recordings.columns.values import Texts

#: From this mean size on, ranges are copied one by one.
LONG = 256
#: Up to this largest size, ranges are cut out of windows that are all as wide.
SHORT = 32
#: No dtype is larger.
LARGEST_ITEM = 1 << 16
#: So many bytes of each large message, which mostly are all but its payload, are copied.
HEAD = 512
#: What large pages of memory align to.
PAGE = 1 << 21


class ArrayPlace(NamedTuple):
    """The place of an array in memory."""

    memory: Any
    offset: int
    shape: tuple[int, ...]
    strides: tuple[int, ...]


class Flat:
    """Messages in one array of bytes."""

    def __init__(self, array: Any) -> None:
        self.array = array
        self.view = memoryview(array)

    def around(self, _position: int) -> tuple[Any, int]:
        """Return what holds a position, and the position at which that begins."""
        return self.view, 0

    def shares(self, numbers: Any) -> bool:
        """Return whether an array may be in this memory."""
        return np.may_share_memory(numbers, self.array)

    def items(self, starts: Any, dtype: str) -> Any:
        """Return what begins at each of some positions: a view, if these are regular."""
        distance = _regular(starts)
        if distance is None:
            return self._windows(dtype)[starts]
        first = int(starts[0])
        return np.ndarray((len(starts),), dtype, self.array, first, (distance,))

    def blocks(self, starts: Any, size: int) -> ArrayPlace:
        """Return where the bytes from each start are: if they are regular, where they were."""
        distance = _regular(starts)
        if distance is not None:
            return ArrayPlace(self.array, int(starts[0]), (len(starts),), (distance,))
        if size > LARGEST_ITEM:
            rows = _copied(repeat(self.view), starts, np.full(len(starts), size))
        else:
            rows = self._windows(f"V{size}")[starts].view(np.uint8)
        return ArrayPlace(rows, 0, (len(starts),), (size,))

    def ranges(self, starts: Any, sizes: Any, item: int = 1) -> Any:
        """Return bytes, so many from each start, one after the other.

        All sizes are multiples of `item`.
        """
        total = int(sizes.sum())
        if not total:
            return np.empty(0, np.uint8)
        if total >= LONG * len(sizes):
            return _copied(repeat(self.view), starts, sizes)
        longest = int(sizes.max())
        if longest <= SHORT and (starts + longest <= len(self.array)).all():
            rows = self._windows(f"V{longest}")[starts].view(np.uint8)
            return rows.reshape(-1, longest)[np.arange(longest) < sizes[:, None]]
        counts = sizes // item
        shift = starts - (np.cumsum(counts) - counts) * item
        places = np.repeat(shift, counts)
        places += np.arange(len(places)) * item
        return self._windows(f"V{item}")[places].view(np.uint8)

    def _windows(self, dtype: str) -> Any:
        """Return an array of what begins at each byte."""
        count = max(0, len(self.array) - np.dtype(dtype).itemsize + 1)
        return np.ndarray((count,), dtype, self.array, strides=(1,))


class Pieces:
    """Large messages where they are, with positions as if they were one array.

    Of their heads there is a copy, where all can be read at once.
    """

    def __init__(self, raws: list[Any], starts: Any) -> None:
        self.raws = [memoryview(raw) for raw in raws]
        self.starts = starts
        heads = [raw[:HEAD] for raw in self.raws]
        self.heads = Flat(np.frombuffer(b"".join(heads), np.uint8))
        sizes = [len(head) for head in heads]
        self.head_starts = np.cumsum([0, *sizes[:-1]])

    def around(self, position: int) -> tuple[Any, int]:
        """Return what holds a position, and the position at which that begins."""
        row = int(np.searchsorted(self.starts, position, "right")) - 1
        return self.raws[row], int(self.starts[row])

    def shares(self, _numbers: Any) -> bool:
        """Return whether an array may be in this memory."""
        return False

    def items(self, starts: Any, dtype: str) -> Any:
        """Return what begins at each of some positions."""
        item = np.dtype(dtype)
        return self.ranges(starts, np.full(len(starts), item.itemsize)).view(item)

    def blocks(self, starts: Any, size: int) -> ArrayPlace:
        """Return where copies of the bytes from each start are."""
        rows = self.ranges(starts, np.full(len(starts), size))
        return ArrayPlace(rows, 0, (len(starts),), (size,))

    def ranges(self, starts: Any, sizes: Any, item: int = 1) -> Any:
        """Return bytes, so many from each start, one after the other."""
        rows = np.searchsorted(self.starts, starts, "right") - 1
        inside = starts - self.starts[rows]
        if (inside + sizes <= HEAD).all():
            return self.heads.ranges(self.head_starts[rows] + inside, sizes, item)
        return _copied(map(self.raws.__getitem__, rows.tolist()), inside, sizes)


BytesSource = Flat | Pieces


def _copied(views: Iterable[Any], starts: Any, sizes: Any) -> Any:
    """Return bytes of views, one after the other, each copied by itself."""
    total, at = int(sizes.sum()), 0
    result: Any = np.empty(total if total < 2 * PAGE else total + PAGE, np.uint8)
    if len(result) > total:  # large pages are all that it is made of
        start = -result.__array_interface__["data"][0] % PAGE
        result = result[start : start + total]
    target = memoryview(result)
    for view, start, size in zip(views, starts.tolist(), sizes.tolist(), strict=False):
        end = at + size
        target[at:end] = view[start : start + size]
        at = end
    return result


def _regular(starts: Any) -> int | None:
    """Return the distance of positions that are all as far from each other."""
    if len(starts) < 2 or starts[1] - starts[0] != starts[-1] - starts[-2]:
        return None
    distance = int(starts[1] - starts[0])
    return distance if (starts[1:] - starts[:-1] == distance).all() else None


# strings, as `deserialize` reads them: invalid UTF-8 and UTF-16 become U+FFFD


def narrow_texts(source: BytesSource, starts: Any, sizes: Any) -> Texts:
    """Return the strings at some places, of so many bytes with their terminating zeros, if any."""
    last = np.maximum(starts + sizes, 1) - 1
    sizes = sizes - ((sizes > 0) & (source.items(last, "u1") == 0))
    texts = Texts(offsets_of(sizes), source.ranges(starts, sizes))
    return texts if _is_utf8(texts) else _valid(texts, "utf-8")


def wide_texts(source: BytesSource, starts: Any, sizes: Any, order: str, big: Any) -> Texts:
    """Return the strings at some places, of so many UTF-16 units of four bytes."""
    units = utf16_units(source, starts, sizes, order)
    if big is not None:
        swapped = np.repeat(big, sizes)
        units[swapped] = units[swapped].byteswap()
    texts = Texts(offsets_of(sizes * 2), units.astype("<u2").view(np.uint8))
    return _valid(texts, "utf-16-le")


def utf16_units(source: BytesSource, starts: Any, sizes: Any, order: str) -> Any:
    """Return the units of strings, one after the other, as numbers."""
    return source.ranges(starts, sizes * 4, 4).view(order + "u4").astype(np.uint32)


def offsets_of(sizes: Any) -> Any:
    """Return where each of some ranges begins, one after the other, and where all end."""
    result = np.zeros(len(sizes) + 1, np.int64)
    np.cumsum(sizes, out=result[1:])
    return result


def _is_utf8(texts: Texts) -> bool:
    """Return whether each text is; that all of them together are is not enough."""
    values = texts.values
    if not len(values) or values.max() < 0x80:
        return True
    begins = values[texts.offsets[:-1][texts.sizes > 0]]
    if ((begins & 0xC0) == 0x80).any():  # within a character
        return False
    try:
        values.tobytes().decode()
    except UnicodeDecodeError:
        return False
    return True


def _valid(texts: Texts, encoding: str) -> Texts:
    """Return texts of an encoding in UTF-8; U+FFFD replaces invalid bytes."""
    raw, ends = texts.values.tobytes(), texts.offsets.tolist()
    parts = [raw[a:b].decode(encoding, "replace").encode() for a, b in pairwise(ends)]
    sizes = np.fromiter(map(len, parts), np.int64, len(parts))
    return Texts(offsets_of(sizes), np.frombuffer(b"".join(parts), np.uint8))
