"""Finding where everything is, in one message after the other.

It finds what a scan finds, and is faster where only few messages still have more to read.
"""

from __future__ import annotations

from struct import Struct
from typing import Any

import numpy as np

from .gather import Source
from .lanes import Found, Lanes, UnreadableError, aligned, repeat_fixed
from .plan import Level, List, Segment, Text


class Walk:
    """Goes over one message at a time.

    `end` is where it ends, values align relative to `phase`, and `view` begins at `shift`.
    `sizes` has all sizes and counts, and where they are.
    """

    def __init__(self, order: str, found: Found) -> None:
        self.unpack = Struct(order + "I").unpack_from
        self.dtype = np.dtype(order + "u4")
        self.found = found
        self.end = self.phase = self.shift = 0
        self.view: Any = b""
        self.sizes: list[tuple[int, int]] = []

    def enter(self, source: Source, lanes: Lanes, row: int) -> None:
        """Begin with the message of a lane."""
        self.sizes = []
        self.end, self.phase = int(lanes.end[row]), int(lanes.phase[row])
        self.view, self.shift = source.around(int(lanes.at[row]))

    def repeat(self, level: Level, at: int, parent: int, indices: range) -> int:
        """Go over elements of a sequence; return the position after them."""
        first = self.found.count[level.key]
        self.found.count[level.key] += len(indices)
        tail(self.found.parent[level.key]).extend([parent] * len(indices))
        tail(self.found.index[level.key]).extend(indices)
        if level.narrow:
            return self.strings(level, at, len(indices))
        for number in range(first, first + len(indices)):
            at = self.level(level, at, number)
        return at

    def level(self, level: Level, at: int, number: int) -> int:
        """Go over a structure, which has a number in its level."""
        for step in level.steps:
            if isinstance(step, Segment):
                at = aligned(at, self.phase, step.align)
                if step.leaves:
                    tail(self.found.at[step.key]).append(at)
                at = self.take(at, step.size)
            elif isinstance(step, Text):
                at = self.text(step, at)
            else:
                at = self.list(step, at, number)
        return at

    def take(self, at: int, size: int) -> int:
        """Go over some bytes."""
        at += size
        if at > self.end:
            raise UnreadableError
        return at

    def number(self, at: int) -> tuple[int, int]:
        """Read a size or count; return it and the position after it."""
        at = aligned(at, self.phase, 4)
        after = self.take(at, 4)
        value: int = self.unpack(self.view, at - self.shift)[0]
        self.sizes.append((at, value))
        return value, after

    def text(self, step: Text, at: int) -> int:
        """Go over a string."""
        size, at = self.number(at)
        if step.key is not None:
            tail(self.found.at[step.key]).append(at)
            tail(self.found.size[step.key]).append(size)
        after = self.take(at, size * 4 if step.wide else size)
        if step.wide:
            units = np.frombuffer(self.view, self.dtype, size, at - self.shift)
            if (units >> 16).any():
                raise UnreadableError
        return after

    def strings(self, level: Level, at: int, count: int) -> int:
        """Go over elements of strings alone, of which there may be very many."""
        unpack, view, shift, end = self.unpack, self.view, self.shift, self.end
        phase, starts, sizes = self.phase, [], []
        for _ in range(count * len(level.steps)):
            at += ((phase - at) & 3) + 4
            if at > end:
                raise UnreadableError
            (size,) = unpack(view, at - 4 - shift)
            starts.append(at)
            sizes.append(size)
            self.sizes.append((at - 4, size))
            at += size
        for index, step in enumerate(level.steps):
            if isinstance(step, Text) and step.key is not None:
                tail(self.found.at[step.key]).extend(starts[index :: len(level.steps)])
                tail(self.found.size[step.key]).extend(sizes[index :: len(level.steps)])
        return self.take(at, 0)

    def list(self, step: List, at: int, number: int) -> int:
        """Go over a sequence."""
        count, at = self.number(at) if step.size is None else (step.size, at)
        if step.bound is not None and count > step.bound:
            raise UnreadableError
        self.take(at, count * step.least)
        if step.key is not None:
            tail(self.found.size[step.key]).append(count)
        level = step.level
        packed = level.packed
        if packed:
            at = aligned(at, self.phase, packed.align) if count else at
            if step.key is not None:
                tail(self.found.at[step.key]).append(at)
            return self.take(at, count * packed.size)
        if not level.fixed:
            return self.repeat(level, at, number, range(count))
        lane = Lanes(*(np.array([one]) for one in (at, self.end, self.phase)))
        repeat_fixed(level, lane, np.array([count]), self.found, number)
        return int(lane.at[0])


def tail(parts: list[Any]) -> list[Any]:
    """Return the last part to add to it: a list, where the others may be arrays."""
    if not parts or type(parts[-1]) is not list:
        parts.append([])
    last: list[Any] = parts[-1]
    return last
