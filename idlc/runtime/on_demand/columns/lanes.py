"""Positions in many messages at once, and what is found at them."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

import numpy as np

from .plan import Level, Segment


class UnreadableError(Exception):
    """A message that is not of its type; which one, and why, is found out afterwards."""


class Found:
    """What is found, by the keys of the plan.

    `at` has where segments, strings and packed sequences begin; `size` how many bytes, units
    or elements they have. Of each element of a level, `parent` has what it is part of, as
    counted there, and `index` its place in that. All are lists of parts, in the order in which
    the elements of a level are met; `count` is how many were.
    """

    def __init__(self) -> None:
        self.at: dict[int, list[Any]] = defaultdict(list)
        self.size: dict[int, list[Any]] = defaultdict(list)
        self.parent: dict[int, list[Any]] = defaultdict(list)
        self.index: dict[int, list[Any]] = defaultdict(list)
        self.count: dict[int, int] = defaultdict(int)

    def enter(self, level: Level, parent: Any, index: Any) -> int:
        """Meet elements of a level; return the number of the first."""
        first = self.count[level.key]
        self.count[level.key] += len(parent)
        self.parent[level.key].append(parent)
        self.index[level.key].append(index)
        return first


class Lanes:
    """Where some messages are read, and where they end: arrays of positions in the buffer.

    Values align relative to `phase`. Positions are never changed in place: who was given them
    may keep them.
    """

    def __init__(self, at: Any, end: Any, phase: Any) -> None:
        self.at = at
        self.end = end
        self.phase = phase

    def some(self, chosen: Any) -> Lanes:
        """Return some of the lanes."""
        return Lanes(self.at[chosen], self.end[chosen], self.phase[chosen])

    def align(self, align: int) -> None:
        """Go to where a value can begin."""
        if align > 1:
            self.at = aligned(self.at, self.phase, align)

    def take(self, size: Any) -> Any:
        """Go over some bytes; return where they are."""
        start = self.at
        self.at = start + size
        if (self.at > self.end).any():
            raise UnreadableError
        return start

    def enough(self, counts: Any, size: int) -> None:
        """Raise UnreadableError unless there are so many times so many bytes."""
        if (counts > np.maximum(self.end - self.at, 0) // max(1, size)).any():
            raise UnreadableError


def aligned(at: Any, phase: Any, align: int) -> Any:
    """Return the next position, or positions, at which a value can begin."""
    return at + ((phase - at) & (align - 1))


def placed(level: Level, at: Any, phase: Any) -> tuple[dict[int, Any], Any]:
    """Return where the segments of a level of fixed size are, and the position after it."""
    starts = {}
    for step in level.steps:
        assert isinstance(step, Segment)
        at = starts[step.key] = aligned(at, phase, step.align)
        at = at + step.size
    return starts, at


def repeat_fixed(
    level: Level, lanes: Lanes, counts: Any, found: Found | None, first: int
) -> None:
    """Go over elements of fixed size with gaps.

    Where the first one begins decides about its gaps. All others begin after one that ends
    with what aligned most, and what follows that: they are alike.
    """
    some = np.flatnonzero(counts)
    counts = counts[some]
    lane = lanes.some(some)
    begin, lane.at = placed(level, lane.at, lane.phase)
    lane.take(0)
    again, _ = placed(level, lane.at, lane.phase)
    after = placed(level, 0, 0)[1]
    distance = placed(level, after, 0)[1] - after
    lane.enough(counts - 1, distance)
    lane.take((counts - 1) * distance)
    lanes.at = lanes.at.copy()
    lanes.at[some] = lane.at
    if found is None or not level.wanted:
        return
    owner = np.repeat(np.arange(len(some)), counts)
    firsts = np.cumsum(counts) - counts
    index = np.arange(len(owner)) - firsts[owner]
    found.enter(level, first + some[owner], index)
    for step in level.steps:
        if isinstance(step, Segment) and step.leaves:
            starts = again[step.key][owner] + (index - 1) * distance
            starts[firsts] = begin[step.key]
            found.at[step.key].append(starts)


def joined(parts: list[Any]) -> Any:
    """Return parts as one array."""
    if len(parts) == 1:
        return np.asarray(parts[0], np.int64)
    return np.concatenate(
        [np.empty(0, np.int64), *(np.asarray(p, np.int64) for p in parts)]
    )
