"""Columns and structured arrays from the result of a scan, in the order of the messages."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from idlc.recordings.columns.plan import (
    Instant,
    Level,
    List,
    Lists,
    Node,
    Numbers,
    Segment,
    Strings,
    Struct,
)
from idlc.recordings.columns.scan import ScanResult, joined
from idlc.recordings.columns.source import (
    Place,
    Source,
    narrow_texts,
    offsets_of,
    rows_of,
    wide_texts,
    without_zeros,
)
from idlc.recordings.columns.values import Columns, Ragged, Texts

#: Texts take as much room as the longest of their column. So many bytes are always taken, and
#: more only up to so many for each byte of the messages.
ALWAYS_TAKEN = 1 << 28
MOST_PER_BYTE = 100


class Elements(NamedTuple):
    """The elements of a level.

    `order` has the place of each, in the order of the scan; None if they are in order. `big`
    says which are big-endian, if only some are.
    """

    level: Level
    total: int
    order: Any
    big: Any


class Table:
    """The located fields of messages of `size` bytes, by column.

    `order` is that of all messages; "<" if only some are big-endian.
    """

    def __init__(self, source: Source, size: int, order: str, scanned: ScanResult) -> None:
        self.source = source
        self.size = size
        self.order = order
        self.scanned = scanned
        self.places: dict[int, tuple[Any, Any]] = {}
        self.lists: dict[int, tuple[Any, Elements]] = {}

    def sorted(self, elements: Elements, parts: list[Any]) -> Any:
        """Return values of elements in the elements' order."""
        values = joined(parts)
        if elements.order is None:
            return values
        result = np.empty_like(values)
        result[elements.order] = values
        return result

    def strings(self, elements: Elements, node: Strings) -> tuple[Any, Any]:
        """Return where strings begin, and their sizes without terminating zeros."""
        key = node.text.key
        assert key is not None
        if key not in self.places:
            starts = self.sorted(elements, self.scanned.at[key])
            sizes = self.sorted(elements, self.scanned.size[key])
            if not node.text.wide:
                sizes = without_zeros(self.source, starts, sizes)
            self.places[key] = starts, sizes
        return self.places[key]

    def texts(self, elements: Elements, node: Strings) -> Texts:
        """Return a column of strings."""
        starts, sizes = self.strings(elements, node)
        if node.text.wide:
            return wide_texts(self.source, starts, sizes, self.order, elements.big)
        return narrow_texts(self.source, starts, sizes)

    def list(self, elements: Elements, step: List) -> tuple[Any, Elements]:
        """Return the offsets of a column of sequences, and what the elements are."""
        assert step.key is not None
        if step.key not in self.lists:
            counts = self.sorted(elements, self.scanned.size[step.key])
            offsets = offsets_of(counts)
            level, order = step.level, None
            if not level.packed:
                parent = joined(self.scanned.parent[level.key])
                if elements.order is not None:
                    parent = elements.order[parent]
                order = offsets[parent] + joined(self.scanned.index[level.key])
                if (order == np.arange(len(order))).all():
                    order = None
            big = None if elements.big is None else np.repeat(elements.big, counts)
            inside = Elements(level, int(offsets[-1]), order, big)
            self.lists[step.key] = offsets, inside
        return self.lists[step.key]

    def numbers(self, elements: Elements) -> dict[int, Any]:
        """Return the numbers of a level, perhaps as views of the buffer, by their keys."""
        result: dict[int, Any] = {}
        for step in elements.level.steps:
            if isinstance(step, Segment) and step.leaves:
                starts = self.sorted(elements, self.scanned.at[step.key])
                place = self.source.blocks(starts, step.size)
                self.cut(step, place, result)
        return result

    def inside(
        self, around: Elements, step: List, elements: Elements, even: bool = False
    ) -> dict[int, Any]:
        """Return the same for the elements of sequences.

        If there are as many in each sequence, and `even`, there may be another dimension.
        """
        packed = step.level.packed
        if not packed:
            return self.numbers(elements)
        assert step.key is not None
        result: dict[int, Any] = {}
        if packed.leaves:
            starts = self.sorted(around, self.scanned.at[step.key])
            counts = self.sorted(around, self.scanned.size[step.key])
            size = packed.size
            place = rows_of(self.source, starts, counts, size) if even else None
            if place is None:
                content = self.source.ranges(starts, counts * size, size)
                place = Place(content, 0, (elements.total,), (size,))
            self.cut(packed, place, result)
        return result

    def native(self, numbers: Any, code: str, big: Any) -> Any:
        """Return numbers as this machine has them, outside of the buffer.

        Those at `big` are big-endian; of bools, every byte but zero is true.
        """
        if code == "?":
            return numbers != 0
        if self.source.shares(numbers):
            numbers = numbers.copy()
        result = np.ascontiguousarray(numbers, code)
        if big is not None:
            result[big] = result[big].byteswap()
        return result

    def cut(self, segment: Segment, place: Place, result: dict[int, Any]) -> None:
        """Add the numbers of a segment at a place."""
        for leaf in segment.leaves:
            shape = (*place.shape, *(count for count, _ in leaf.repeats))
            strides = (*place.strides, *(distance for _, distance in leaf.repeats))
            dtype = np.dtype(self.order + leaf.code.replace("?", "u1"))
            if 0 in shape:
                numbers: Any = np.empty(shape, dtype)
            else:
                start = place.offset + leaf.offset
                numbers = np.ndarray(shape, dtype, place.memory, start, strides)
            result[leaf.key] = numbers


def columns_of(table: Table, top: Elements) -> Columns:
    """Return the columns of all messages."""
    making = _Making(table, top, table.numbers(top))
    columns: Columns = making.column(top.level.node, top.total)
    return columns


class Reading:
    """Reads columns of the elements of one level, whose numbers are found already."""

    def __init__(self, table: Table, elements: Elements, numbers: dict[int, Any]) -> None:
        self.table = table
        self.elements = elements
        self.numbers = numbers

    def inside(self, step: List, even: bool = False) -> tuple[Any, Any]:
        """Return the offsets of a column of sequences, and what reads their elements."""
        offsets, elements = self.table.list(self.elements, step)
        numbers = self.table.inside(self.elements, step, elements, even)
        return offsets, type(self)(self.table, elements, numbers)


class _Making(Reading):
    """Makes columns of the elements of one level."""

    def column(self, node: Node, count: int, depth: int = 0) -> Any:
        """Return a column of `count` values, which are in arrays of so many dimensions."""
        if isinstance(node, Numbers):
            numbers = self.table.native(self.numbers[node.key], node.code, self.elements.big)
            return numbers.reshape(count, *numbers.shape[1 + depth :])
        if isinstance(node, Strings):
            return self.table.texts(self.elements, node)
        if isinstance(node, Instant):
            parts = (node.seconds, node.nanoseconds)
            return instants(node, *(self.column(part, count, depth) for part in parts))
        if isinstance(node, Lists):
            return self.lists(node, count, depth)
        columns = {name: self.column(inner, count, depth) for name, inner in node.fields.items()}
        return Columns(columns, count)

    def lists(self, node: Lists, count: int, depth: int) -> Ragged:
        """Return a column of sequences or arrays."""
        if node.step is None:
            assert node.size is not None
            offsets: Any = np.arange(count + 1) * node.size
            inner = self.column(node.element, count * node.size, depth + 1)
            return Ragged(offsets, inner)
        offsets, inside = self.inside(node.step)
        return Ragged(offsets, inside.column(node.element, int(offsets[-1])))


def instants(node: Instant, seconds: Any, nanoseconds: Any) -> Any:
    """Return times of numpy."""
    return (seconds.astype(np.int64) * 1_000_000_000 + nanoseconds).view(node.code)


class UnevenError(Exception):
    """Columns that a structured array cannot hold."""


def structured(table: Table, top: Elements) -> Any:
    """Return a structured array with a row for each message; raise UnevenError."""
    node = top.level.node
    dtype = _Types(table, top).dtype(node, top, "")
    needed, present = top.total * dtype.itemsize, table.size
    if needed > max(ALWAYS_TAKEN, MOST_PER_BYTE * present):
        raise UnevenError(
            f"the array would take {needed:,} bytes for {present:,} bytes of messages, "
            f"as each text takes as much as the longest of its column"
        )
    result = np.zeros(top.total, dtype)
    _Filling(table, top, table.numbers(top)).fill(node, result)
    return result


class _Types:
    """Finds the dtypes of columns; raises UnevenError where there is none."""

    def __init__(self, table: Table, top: Elements) -> None:
        self.table = table
        self.top = top

    def dtype(self, node: Node, elements: Elements, path: str) -> Any:
        """Return the dtype of a column."""
        if isinstance(node, Numbers):
            number: Any = np.dtype(node.code)
            return number if node.size is None else np.dtype((number, (node.size,)))
        if isinstance(node, Instant):
            return np.dtype(node.code)
        if isinstance(node, Struct):
            return np.dtype(
                [
                    (
                        name,
                        self.dtype(inner, elements, f"{path}.{name}" if path else name),
                    )
                    for name, inner in node.fields.items()
                ]
            )
        if isinstance(node, Lists):
            count, inside = self.count(node, elements, path)
            element = self.dtype(node.element, inside, path)
            return np.dtype((element, (count,)))
        if node.text.wide:
            raise UnevenError(f"{path} is a wstring, which no structured array can hold")
        _, sizes = self.table.strings(elements, node)
        return np.dtype(f"S{max(1, int(sizes.max(initial=0)))}")

    def count(self, node: Lists, elements: Elements, path: str) -> tuple[int, Elements]:
        """Return how many elements all have, and what these are."""
        if node.step is None:
            assert node.size is not None
            return node.size, elements
        offsets, inside = self.table.list(elements, node.step)
        counts = np.diff(offsets)
        if not len(counts):
            return node.size or 0, inside
        other = np.flatnonzero(counts != counts[0])
        if len(other):
            where = f"[{other[0]}].{path}" if elements is self.top else path
            raise UnevenError(
                f"{where}: has {counts[other[0]]} elements and {counts[0]} before; "
                f"a structured array needs the same number in each"
            )
        return int(counts[0]), inside


class _Filling(Reading):
    """Copies columns of the elements of one level into a structured array."""

    def fill(self, node: Node, target: Any) -> None:
        """Copy a column."""
        if isinstance(node, Struct):
            for name, inner in node.fields.items():
                self.fill(inner, target[name])
        elif isinstance(node, Lists):
            self.lists(node, target)
        elif isinstance(node, Strings):
            self.strings(node, target)
        else:
            target[...] = self.value(node).reshape(target.shape)

    def strings(self, node: Strings, target: Any) -> None:
        """Copy a column of strings."""
        starts, sizes = self.table.strings(self.elements, node)
        texts = self.table.source.strings(starts, sizes, target.dtype.itemsize)
        target[...] = texts.reshape(target.shape)

    def value(self, node: Numbers | Instant) -> Any:
        """Return numbers or times, which may be in the buffer."""
        if isinstance(node, Instant):
            return instants(node, self.value(node.seconds), self.value(node.nanoseconds))
        numbers, big = self.numbers[node.key], self.elements.big
        if node.code == "?" or big is not None:
            return self.table.native(numbers, node.code, big)
        return numbers

    def lists(self, node: Lists, target: Any) -> None:
        """Copy a column of sequences or arrays."""
        inside = self
        if node.step is not None:
            _, inside = self.inside(node.step, self.elements.big is None)
        inside.fill(node.element, target)
