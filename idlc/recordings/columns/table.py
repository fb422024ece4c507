"""Columns from the result of a scan, in the order of the messages."""

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
)
from idlc.recordings.columns.scan import ScanResult, joined
from idlc.recordings.columns.source import (
    Place,
    Source,
    narrow_texts,
    offsets_of,
    wide_texts,
    without_zeros,
)
from idlc.recordings.columns.values import Columns, Ragged, Texts


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
    """The located fields of messages, by column.

    `order` is that of all messages; "<" if only some are big-endian.
    """

    def __init__(self, source: Source, order: str, scanned: ScanResult) -> None:
        self.source = source
        self.order = order
        self.scanned = scanned

    def sorted(self, elements: Elements, parts: list[Any]) -> Any:
        """Return values of elements in the elements' order."""
        values = joined(parts)
        if elements.order is None:
            return values
        result = np.empty_like(values)
        result[elements.order] = values
        return result

    def texts(self, elements: Elements, node: Strings) -> Texts:
        """Return a column of strings."""
        key = node.text.key
        assert key is not None
        starts = self.sorted(elements, self.scanned.at[key])
        sizes = self.sorted(elements, self.scanned.size[key])
        if node.text.wide:
            return wide_texts(self.source, starts, sizes, self.order, elements.big)
        return narrow_texts(self.source, starts, without_zeros(self.source, starts, sizes))

    def list(self, elements: Elements, step: List) -> tuple[Any, Elements]:
        """Return the offsets of a column of sequences, and what the elements are."""
        assert step.key is not None
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
        return offsets, Elements(level, int(offsets[-1]), order, big)

    def numbers(self, elements: Elements) -> dict[int, Any]:
        """Return the numbers of a level, perhaps as views of the buffer, by their keys."""
        result: dict[int, Any] = {}
        for step in elements.level.steps:
            if isinstance(step, Segment) and step.leaves:
                starts = self.sorted(elements, self.scanned.at[step.key])
                place = self.source.blocks(starts, step.size)
                self.cut(step, place, result)
        return result

    def inside(self, around: Elements, step: List, elements: Elements) -> dict[int, Any]:
        """Return the same for the elements of sequences."""
        packed = step.level.packed
        if not packed:
            return self.numbers(elements)
        assert step.key is not None
        result: dict[int, Any] = {}
        if packed.leaves:
            starts = self.sorted(around, self.scanned.at[step.key])
            counts = self.sorted(around, self.scanned.size[step.key])
            size = packed.size
            content = self.source.ranges(starts, counts * size, size)
            self.cut(packed, Place(content, 0, (elements.total,), (size,)), result)
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


class _Making:
    """Makes columns of the elements of one level, whose numbers are found already."""

    def __init__(self, table: Table, elements: Elements, numbers: dict[int, Any]) -> None:
        self.table = table
        self.elements = elements
        self.numbers = numbers

    def column(self, node: Node, count: int, depth: int = 0) -> Any:
        """Return a column of `count` values, which are in arrays of so many dimensions."""
        if isinstance(node, Numbers):
            numbers = self.table.native(self.numbers[node.key], node.code, self.elements.big)
            return numbers.reshape(count, *numbers.shape[1 + depth :])
        if isinstance(node, Strings):
            return self.table.texts(self.elements, node)
        if isinstance(node, Instant):
            parts = (node.seconds, node.nanoseconds)
            seconds, nanoseconds = (self.column(part, count, depth) for part in parts)
            return (seconds.astype(np.int64) * 1_000_000_000 + nanoseconds).view(node.code)
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
        offsets, elements = self.table.list(self.elements, node.step)
        numbers = self.table.inside(self.elements, node.step, elements)
        inside = _Making(self.table, elements, numbers)
        return Ragged(offsets, inside.column(node.element, elements.total))
