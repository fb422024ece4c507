"""Finding where everything is, in many messages at once.

All messages go forward together, step by step: what one step needs of each message is one
operation of numpy. In sequences of what is not of fixed size, their first elements go
together, then their second ones, and so on; where few are left, they go one by one.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .gather import Source
from .lanes import Found, Lanes, UnreadableError, repeat_fixed
from .plan import Level, List, Segment, Text
from .texts import utf16_units
from .walk import Walk

#: So few messages are faster one by one.
FEW = 16


class Scan:
    """Goes over messages of one byte order."""

    def __init__(self, source: Source, order: str, found: Found) -> None:
        self.found = found
        self.source = source
        self.order = order
        self.walk = Walk(order, found)

    def level(self, level: Level, lanes: Lanes, first: int) -> None:
        """Go over a structure in each lane, which in its level count from `first` on."""
        for step in level.steps:
            if isinstance(step, Segment):
                lanes.align(step.align)
                start = lanes.take(step.size)
                if step.leaves:
                    self.found.at[step.key].append(start)
            elif isinstance(step, Text):
                self.text(step, lanes)
            else:
                self.list(step, lanes, first)

    def number(self, lanes: Lanes) -> Any:
        """Read a size or count in each lane."""
        lanes.align(4)
        numbers = self.source.items(lanes.take(4), f"{self.order}u4")
        return numbers.astype(np.int64)

    def text(self, step: Text, lanes: Lanes) -> None:
        """Go over a string in each lane."""
        size = self.number(lanes)
        start = lanes.take(size * 4 if step.wide else size)
        if (
            step.wide
            and (utf16_units(self.source, start, size, self.order) >> 16).any()
        ):
            raise UnreadableError
        if step.key is not None:
            self.found.at[step.key].append(start)
            self.found.size[step.key].append(size)

    def list(self, step: List, lanes: Lanes, first: int) -> None:
        """Go over a sequence in each lane."""
        if step.size is None:
            counts = self.number(lanes)
        else:
            counts = np.full(len(lanes.at), step.size, np.int64)
        if step.bound is not None and (counts > step.bound).any():
            raise UnreadableError
        lanes.enough(counts, step.least)
        if step.key is not None:
            self.found.size[step.key].append(counts)
        packed = step.level.packed
        if packed:
            self.packed(step, packed, lanes, counts)
        elif step.level.fixed:
            repeat_fixed(step.level, lanes, counts, self.found, first)
        else:
            self.varied(step.level, lanes, counts, first)

    def packed(self, step: List, packed: Segment, lanes: Lanes, counts: Any) -> None:
        """Go over elements without gaps."""
        before = lanes.at
        lanes.align(packed.align)
        lanes.at = np.where(counts > 0, lanes.at, before)
        lanes.enough(counts, packed.size)
        start = lanes.take(counts * packed.size)
        if step.key is not None:
            self.found.at[step.key].append(start)

    def varied(self, level: Level, lanes: Lanes, counts: Any, first: int) -> None:
        """Go over elements that are not of fixed size: in all lanes the first ones, and so on."""
        order = np.argsort(-counts, kind="stable")
        descending = -counts[order]
        rest = lanes.some(order)
        index, active = 0, int(np.searchsorted(descending, 0))
        while active >= FEW:
            begin = rest.at[:active].copy()
            lane = Lanes(begin, rest.end[:active], rest.phase[:active])
            parent = first + order[:active]
            number = self.found.enter(level, parent, np.full(active, index))
            self.level(level, lane, number)
            rest.at[:active] = lane.at
            index += 1
            active = int(np.searchsorted(descending, -index))
        for row in range(active):
            self.walk.enter(self.source, rest, row)
            elements = range(index, -int(descending[row]))
            at = int(rest.at[row])
            rest.at[row] = self.walk.repeat(
                level, at, first + int(order[row]), elements
            )
        lanes.at = lanes.at.copy()
        lanes.at[order] = rest.at
