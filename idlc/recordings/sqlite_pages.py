"""The pages of a SQLite table: which rows each has, read without SQLite.

SQLite stops at the first page that is damaged. The pages above it say which rows come after it.
"""

from __future__ import annotations

from collections.abc import Iterator
from struct import unpack_from
from typing import NamedTuple

from idlc.recordings.containers.source import FileSource

INTERIOR, LEAF = 5, 13
#: Numbers of rows.
SMALLEST, LARGEST = -(1 << 63), (1 << 63) - 1


class RowSpan(NamedTuple):
    """The rows from one number to another, which are in a page if anywhere."""

    first: int
    last: int
    page: int


class Cell(NamedTuple):
    """A row in a page; `rest` bytes are in pages of which `overflow` is the first."""

    row: int
    overflow: int
    rest: int


class Pages:
    """The pages of a database; `usable` bytes of each are SQLite's."""

    def __init__(self, source: FileSource, size: int, reserved: int) -> None:
        self.source = source
        self.size = size
        self.usable = size - reserved
        self.count = -(-source.size // size)

    def page(self, number: int) -> memoryview:
        """Return as much of a page as the file has."""
        if not 1 <= number <= self.count:
            return memoryview(b"")
        start = (number - 1) * self.size
        return self.source.view(start, min(self.size, self.source.size - start))

    def leaves(self, root: int) -> Iterator[RowSpan]:
        """Yield the leaves of a table in their order.

        A page that cannot be read stands for all below it.
        """
        seen: set[int] = set()
        waiting = [RowSpan(SMALLEST, LARGEST, root)]
        while waiting:
            leaf = waiting.pop()
            if leaf.page in seen:
                continue
            seen.add(leaf.page)
            data = self.page(leaf.page)
            start = 100 * (leaf.page == 1)
            if len(data) < self.size or data[start] != INTERIOR:
                yield leaf
                continue
            (right,) = unpack_from(">I", data, start + 8)
            below, first = [], leaf.first
            for at in self._cells(data, start, 12):
                (child,) = unpack_from(">I", data, at)
                last, _ = _varint(data, at + 4)
                if first <= last <= leaf.last:
                    below.append(RowSpan(first, last, child))
                    first = last + 1
            if first <= leaf.last:
                below.append(RowSpan(first, leaf.last, right))
            waiting += below[::-1]

    def rows(self, number: int) -> Iterator[Cell]:
        """Yield the rows in a leaf that the file has as a whole; nothing if it cannot be read."""
        data = self.page(number)
        start = 100 * (number == 1)
        if len(data) < start + 8 or data[start] != LEAF:
            return
        most, least = self.usable - 35, (self.usable - 12) * 32 // 255 - 23
        for at in self._cells(data, start, 8):
            size, at = _varint(data, at)
            row, at = _varint(data, at)
            local, overflow = size, 0
            if size > most:
                local = least + (size - least) % (self.usable - 4)
                local = local if local <= most else least
                if 0 <= at + local <= len(data) - 4:
                    (overflow,) = unpack_from(">I", data, at + local)
            if len(data) == self.size or at + local + 4 * (size > most) <= len(data):
                yield Cell(row, overflow, size - local)

    def is_whole(self, cell: Cell) -> bool:
        """Return whether the file has all bytes of a row."""
        number, rest, seen = cell.overflow, cell.rest, 0
        while number and rest > 0 and seen <= self.count:
            page = self.page(number)
            if len(page) < min(rest + 4, self.usable):
                return False
            (number,) = unpack_from(">I", page)
            rest -= self.usable - 4
            seen += 1
        return rest <= 0

    def _cells(self, data: memoryview, start: int, head: int) -> Iterator[int]:
        """Yield where in a page the cells are."""
        (count,) = unpack_from(">H", data, start + 3)
        count = min(count, (len(data) - start - head) // 2)
        for (at,) in [unpack_from(">H", data, start + head + 2 * n) for n in range(count)]:
            if at <= len(data) - 4:  # no cell is smaller
                yield at


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    """Return a number of SQLite, as a signed one, and where it ends."""
    value = 0
    for index in range(9):
        byte = data[at] if at < len(data) else 0
        at += 1
        if index == 8:
            value = value << 8 | byte
            break
        value = value << 7 | byte & 0x7F
        if byte < 0x80:
            break
    return value - (1 << 64) * (value >> 63), at
