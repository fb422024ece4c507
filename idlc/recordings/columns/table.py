"""Columns from the result of a scan, in the order of the messages."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from idlc.recordings.columns.plan import List, Numbers, PlanLevel, PlanNode, Segment, Struct, Text
from idlc.recordings.columns.scan import ScanResult, joined
from idlc.recordings.columns.source import (
    ArrayPlace,
    BytesSource,
    narrow_texts,
    offsets_of,
    wide_texts,
)
from idlc.recordings.columns.values import Columns, Ragged


class Elements(NamedTuple):
    """The elements of a level.

    `order` has the place of each, in the order of the scan; None if they are in order. `big`
    says which are big-endian, if only some are.
    """

    level: PlanLevel
    total: int
    order: Any
    big: Any


class Table:
    """The located fields of messages, by column.

    `order` is that of all messages; "<" if only some are big-endian.
    """

    def __init__(self, source: BytesSource, order: str, scanned: ScanResult) -> None:
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

    def columns(self, top: Elements) -> Columns:
        """Return the columns of all messages."""
        columns: Columns = self.column(top.level.node, top.total, top, self.numbers(top))
        return columns

    def column(
        self,
        node: PlanNode,
        count: int,
        elements: Elements,
        numbers: dict[int, Any],
        depth: int = 0,
    ) -> Any:
        """Return a column of `count` values, which are in arrays of `depth` dimensions.

        They are of `elements`, whose `numbers` are found already.
        """
        if isinstance(node, Numbers):
            values = self.native(numbers[node.key], node.code, elements.big)
            return values.reshape(count, *values.shape[1 + depth :])
        if isinstance(node, Text):
            assert node.key is not None
            starts = self.sorted(elements, self.scanned.at[node.key])
            sizes = self.sorted(elements, self.scanned.size[node.key])
            if node.wide:
                return wide_texts(self.source, starts, sizes, self.order, elements.big)
            return narrow_texts(self.source, starts, sizes)
        if isinstance(node, Struct):
            columns = {
                name: self.column(inner, count, elements, numbers, depth)
                for name, inner in node.fields.items()
            }
            return Columns(columns, count, node.times)
        if node.step is not None:
            offsets, elements, numbers = self.inside(elements, node.step)
            inner = self.column(node.element, elements.total, elements, numbers)
            return Ragged(offsets, inner, node.size)
        assert node.size is not None
        every = count * node.size
        inner = self.column(node.element, every, elements, numbers, depth + 1)
        return Ragged(np.arange(count + 1) * node.size, inner, node.size)

    def inside(self, around: Elements, step: List) -> tuple[Any, Elements, dict[int, Any]]:
        """Return the offsets of a column of sequences, their elements, and the numbers in these."""
        assert step.key is not None
        counts = self.sorted(around, self.scanned.size[step.key])
        offsets = offsets_of(counts)
        level, packed, order = step.level, step.level.packed, None
        if not packed:
            parent = joined(self.scanned.parent[level.key])
            if around.order is not None:
                parent = around.order[parent]
            order = offsets[parent] + joined(self.scanned.index[level.key])
            if (order == np.arange(len(order))).all():
                order = None
        big = None if around.big is None else np.repeat(around.big, counts)
        elements = Elements(level, int(offsets[-1]), order, big)
        numbers: dict[int, Any] = {}
        if packed and packed.leaves:
            starts, size = self.sorted(around, self.scanned.at[step.key]), packed.size
            content = self.source.ranges(starts, counts * size, size)
            self.cut(packed, ArrayPlace(content, 0, (elements.total,), (size,)), numbers)
        elif not packed:
            numbers = self.numbers(elements)
        return offsets, elements, numbers

    def numbers(self, elements: Elements) -> dict[int, Any]:
        """Return the numbers of a level, perhaps as views of the buffer, by their keys."""
        result: dict[int, Any] = {}
        for step in elements.level.steps:
            if isinstance(step, Segment) and step.leaves:
                starts = self.sorted(elements, self.scanned.at[step.key])
                self.cut(step, self.source.blocks(starts, step.size), result)
        return result

    def native(self, numbers: Any, code: str, big: Any) -> Any:
        """Return numbers as this machine has them, and outside of the messages.

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

    def cut(self, segment: Segment, place: ArrayPlace, result: dict[int, Any]) -> None:
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
