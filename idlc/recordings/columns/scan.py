"""Locating every field in many messages at once.

All messages advance together, step by step: each step takes one operation of numpy for all of
them. In sequences whose elements vary in size, the first elements of all messages advance
together, then the second ones, and so on; the few that are left are scanned one by one. Of
messages that share one layout, only the first is scanned.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from struct import Struct
from typing import Any

import numpy as np

from idlc.recordings.columns.plan import List, PlanLevel, Segment, Text
from idlc.recordings.columns.source import BytesSource, utf16_units


class UnreadableError(Exception):
    """A message that is not of its type; which one, and why, is established afterwards."""


class ScanResult:
    """The location of each field, by the keys of the plan.

    `at` has where segments, strings and packed sequences begin; `size` how many bytes, units
    or elements they have. Of each element of a level, `parent` has what it is part of, as
    counted there, and `index` its place in that. All are lists of parts, in the order in which
    the elements of a level are met; `count` is their number.
    """

    def __init__(self) -> None:
        self.at: dict[int, list[Any]] = defaultdict(list)
        self.size: dict[int, list[Any]] = defaultdict(list)
        self.parent: dict[int, list[Any]] = defaultdict(list)
        self.index: dict[int, list[Any]] = defaultdict(list)
        self.count: dict[int, int] = defaultdict(int)

    def enter(self, level: PlanLevel, parent: Any, index: Any) -> int:
        """Add elements of a level; return the number of the first."""
        first = self.count[level.key]
        self.count[level.key] += len(parent)
        self.parent[level.key].append(parent)
        self.index[level.key].append(index)
        return first


class Cursors:
    """Arrays of positions in the buffer, where some messages are read and where they end.

    Values align relative to `phase`. Arrays of positions are never changed in place, so they
    may be kept.
    """

    def __init__(self, at: Any, end: Any, phase: Any) -> None:
        self.at = at
        self.end = end
        self.phase = phase

    def select(self, chosen: Any) -> Cursors:
        """Return some of the cursors."""
        return Cursors(self.at[chosen], self.end[chosen], self.phase[chosen])

    def align(self, align: int) -> None:
        """Advance to where a value can begin."""
        if align > 1:
            self.at = aligned(self.at, self.phase, align)

    def advance(self, size: Any) -> Any:
        """Advance by some bytes; return where they are."""
        start = self.at
        self.at = start + size
        if (self.at > self.end).any():
            raise UnreadableError
        return start

    def require(self, counts: Any, size: int) -> None:
        """Raise UnreadableError unless `counts` times `size` bytes are left."""
        if (counts > np.maximum(self.end - self.at, 0) // max(1, size)).any():
            raise UnreadableError


def aligned(at: Any, phase: Any, align: int) -> Any:
    """Return the next position, or positions, at which a value can begin."""
    return at + ((phase - at) & (align - 1))


def placed(level: PlanLevel, at: Any, phase: Any) -> tuple[dict[int, Any], Any]:
    """Return where the segments of a level of fixed size are, and the position after it."""
    starts = {}
    for step in level.steps:
        assert isinstance(step, Segment)
        at = starts[step.key] = aligned(at, phase, step.align)
        at = at + step.size
    return starts, at


def repeat_fixed(
    level: PlanLevel, cursors: Cursors, counts: Any, result: ScanResult, first: int
) -> None:
    """Scan elements of fixed size with gaps.

    Where the first one begins decides about its gaps. All others begin after one that ends
    with what aligned most, and what follows that: they have equal gaps.
    """
    some = np.flatnonzero(counts)
    counts = counts[some]
    cursor = cursors.select(some)
    begin, cursor.at = placed(level, cursor.at, cursor.phase)
    cursor.advance(0)
    again, _ = placed(level, cursor.at, cursor.phase)
    after = placed(level, 0, 0)[1]
    distance = placed(level, after, 0)[1] - after
    cursor.require(counts - 1, distance)
    cursor.advance((counts - 1) * distance)
    cursors.at = cursors.at.copy()
    cursors.at[some] = cursor.at
    if not level.wanted:
        return
    owner = np.repeat(np.arange(len(some)), counts)
    firsts = np.cumsum(counts) - counts
    index = np.arange(len(owner)) - firsts[owner]
    result.enter(level, first + some[owner], index)
    for step in level.steps:
        if isinstance(step, Segment) and step.leaves:
            starts = again[step.key][owner] + (index - 1) * distance
            starts[firsts] = begin[step.key]
            result.at[step.key].append(starts)


def joined(parts: list[Any]) -> Any:
    """Return parts as one array."""
    if len(parts) == 1:
        return np.asarray(parts[0], np.int64)
    return np.concatenate([np.empty(0, np.int64), *(np.asarray(p, np.int64) for p in parts)])


class SequentialScan:
    """Scans one message at a time, which is faster where few have more to read.

    `end` is where it ends, values align relative to `phase`, and `view` begins at `shift`.
    `sizes` has all sizes and counts, and where they are.
    """

    def __init__(self, order: str, result: ScanResult) -> None:
        self.unpack = Struct(order + "I").unpack_from
        self.dtype = np.dtype(order + "u4")
        self.result = result
        self.end = self.phase = self.shift = 0
        self.view: Any = b""
        self.sizes: list[tuple[int, int]] = []

    def enter(self, source: BytesSource, cursors: Cursors, row: int) -> None:
        """Start with the message at a cursor."""
        self.sizes = []
        self.end, self.phase = int(cursors.end[row]), int(cursors.phase[row])
        self.view, self.shift = source.around(int(cursors.at[row]))

    def repeat(self, level: PlanLevel, at: int, parent: int, indices: range) -> int:
        """Scan elements of a sequence; return the position after them."""
        first = self.result.count[level.key]
        self.result.count[level.key] += len(indices)
        tail(self.result.parent[level.key]).extend([parent] * len(indices))
        tail(self.result.index[level.key]).extend(indices)
        if level.narrow:
            return self.strings(level, at, len(indices))
        for number in range(first, first + len(indices)):
            at = self.level(level, at, number)
        return at

    def level(self, level: PlanLevel, at: int, number: int) -> int:
        """Scan a structure, which has a number in its level."""
        for step in level.steps:
            if isinstance(step, Segment):
                at = aligned(at, self.phase, step.align)
                if step.leaves:
                    tail(self.result.at[step.key]).append(at)
                at = self.advance(at, step.size)
            elif isinstance(step, Text):
                at = self.text(step, at)
            else:
                at = self.list(step, at, number)
        return at

    def advance(self, at: int, size: int) -> int:
        """Return the position after some bytes; raise UnreadableError past the end."""
        at += size
        if at > self.end:
            raise UnreadableError
        return at

    def number(self, at: int) -> tuple[int, int]:
        """Read a size or count; return it and the position after it."""
        at = aligned(at, self.phase, 4)
        after = self.advance(at, 4)
        value: int = self.unpack(self.view, at - self.shift)[0]
        self.sizes.append((at, value))
        return value, after

    def text(self, step: Text, at: int) -> int:
        """Scan a string."""
        size, at = self.number(at)
        if step.key is not None:
            tail(self.result.at[step.key]).append(at)
            tail(self.result.size[step.key]).append(size)
        after = self.advance(at, size * 4 if step.wide else size)
        if step.wide:
            units = np.frombuffer(self.view, self.dtype, size, at - self.shift)
            if (units >> 16).any():
                raise UnreadableError
        return after

    def strings(self, level: PlanLevel, at: int, count: int) -> int:
        """Scan elements that consist of strings, of which there may be very many."""
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
                tail(self.result.at[step.key]).extend(starts[index :: len(level.steps)])
                tail(self.result.size[step.key]).extend(sizes[index :: len(level.steps)])
        return self.advance(at, 0)

    def list(self, step: List, at: int, number: int) -> int:
        """Scan a sequence."""
        count, at = self.number(at) if step.size is None else (step.size, at)
        if step.bound is not None and count > step.bound:
            raise UnreadableError
        self.advance(at, count * step.least)
        if step.key is not None:
            tail(self.result.size[step.key]).append(count)
        level = step.level
        packed = level.packed
        if packed:
            at = aligned(at, self.phase, packed.align) if count else at
            if step.key is not None:
                tail(self.result.at[step.key]).append(at)
            return self.advance(at, count * packed.size)
        if not level.fixed:
            return self.repeat(level, at, number, range(count))
        cursor = Cursors(*(np.array([value]) for value in (at, self.end, self.phase)))
        repeat_fixed(level, cursor, np.array([count]), self.result, number)
        return int(cursor.at[0])


def tail(parts: list[Any]) -> list[Any]:
    """Return the last part to add to it: a list, where the others may be arrays."""
    if not parts or type(parts[-1]) is not list:
        parts.append([])
    last: list[Any] = parts[-1]
    return last


#: Below this number, messages are scanned one by one.
FEW = 16


class VectorScan:
    """Scans all messages of one byte order together."""

    def __init__(self, source: BytesSource, order: str, result: ScanResult) -> None:
        self.result = result
        self.source = source
        self.order = order
        self.sequential = SequentialScan(order, result)

    def level(self, level: PlanLevel, cursors: Cursors, first: int) -> None:
        """Scan a structure at each cursor; in their level they are numbered from `first`."""
        for step in level.steps:
            if isinstance(step, Segment):
                cursors.align(step.align)
                start = cursors.advance(step.size)
                if step.leaves:
                    self.result.at[step.key].append(start)
            elif isinstance(step, Text):
                self.text(step, cursors)
            else:
                self.list(step, cursors, first)

    def number(self, cursors: Cursors) -> Any:
        """Read a size or count at each cursor."""
        cursors.align(4)
        numbers = self.source.items(cursors.advance(4), f"{self.order}u4")
        return numbers.astype(np.int64)

    def text(self, step: Text, cursors: Cursors) -> None:
        """Scan a string at each cursor."""
        size = self.number(cursors)
        start = cursors.advance(size * 4 if step.wide else size)
        if step.wide and (utf16_units(self.source, start, size, self.order) >> 16).any():
            raise UnreadableError
        if step.key is not None:
            self.result.at[step.key].append(start)
            self.result.size[step.key].append(size)

    def list(self, step: List, cursors: Cursors, first: int) -> None:
        """Scan a sequence at each cursor."""
        if step.size is None:
            counts = self.number(cursors)
        else:
            counts = np.full(len(cursors.at), step.size, np.int64)
        if step.bound is not None and (counts > step.bound).any():
            raise UnreadableError
        cursors.require(counts, step.least)
        if step.key is not None:
            self.result.size[step.key].append(counts)
        packed = step.level.packed
        if packed:
            before = cursors.at
            cursors.align(packed.align)
            cursors.at = np.where(counts > 0, cursors.at, before)
            cursors.require(counts, packed.size)
            start = cursors.advance(counts * packed.size)
            if step.key is not None:
                self.result.at[step.key].append(start)
        elif step.level.fixed:
            repeat_fixed(step.level, cursors, counts, self.result, first)
        else:
            self.varied(step.level, cursors, counts, first)

    def varied(self, level: PlanLevel, cursors: Cursors, counts: Any, first: int) -> None:
        """Scan elements of varying size: all first ones, all second ones, and so on."""
        order = np.argsort(-counts, kind="stable")
        descending = -counts[order]
        rest = cursors.select(order)
        index, active = 0, int(np.searchsorted(descending, 0))
        while active >= FEW:
            begin = rest.at[:active].copy()
            cursor = Cursors(begin, rest.end[:active], rest.phase[:active])
            parent = first + order[:active]
            number = self.result.enter(level, parent, np.full(active, index))
            self.level(level, cursor, number)
            rest.at[:active] = cursor.at
            index += 1
            active = int(np.searchsorted(descending, -index))
        for row in range(active):
            self.sequential.enter(self.source, rest, row)
            elements = range(index, -int(descending[row]))
            at = int(rest.at[row])
            rest.at[row] = self.sequential.repeat(level, at, first + int(order[row]), elements)
        cursors.at = cursors.at.copy()
        cursors.at[order] = rest.at


#: Fewer messages, or a smaller part of them of one layout, are not worth the comparison.
LEAST_UNIFORM = 64
LEAST_PART = 0.25


def scan_uniform(
    plan: PlanLevel, source: BytesSource, order: str, cursors: Cursors, result: ScanResult
) -> Iterator[tuple[Any, int]]:
    """Scan messages that share one layout; yield the indices of their cursors, layout by layout.

    With them comes the number of bytes that are left in each of the messages.
    """
    rest = np.arange(len(cursors.at))
    # others take no operation for each element
    varies = any(isinstance(step, List) and not step.level.fixed for step in plan.steps)
    while varies and len(rest) >= LEAST_UNIFORM:
        cursor = cursors.select(rest)
        first = ScanResult()
        scan = SequentialScan(order, first)
        scan.enter(source, cursor, 0)
        first.count[plan.key] = 1
        end = scan.level(plan, int(cursor.at[0]), 0)
        # which have the length of the first, and its sizes at the same places
        lengths = cursor.end - cursor.at
        same = lengths == lengths[0]
        starts = cursor.at[same]
        equal: Any = True
        for at, size in scan.sizes:
            equal &= source.items(starts + (at - int(starts[0])), f"{order}u4") == size
        same[same] = equal
        if same.sum() < LEAST_PART * len(rest):
            return
        chosen = rest[same]
        _replicate(plan, first, cursors.at[chosen], result)
        yield chosen, int(cursor.end[0]) - end
        rest = rest[~same]


def _replicate(plan: PlanLevel, first: ScanResult, starts: Any, result: ScanResult) -> None:
    """Add the locations in the first of some messages for all of them."""
    repeats = len(starts)
    for key, parts in first.at.items():
        places = joined(parts) - starts[0]
        result.at[key].append((starts[:, None] + places).ravel())
    for key, parts in first.size.items():
        result.size[key].append(np.tile(joined(parts), repeats))
    for level, around in _levels(plan):
        if level.key in first.parent:
            number = result.count[around.key] + np.arange(repeats) * first.count[around.key]
            parents = number[:, None] + joined(first.parent[level.key])
            result.parent[level.key].append(parents.ravel())
            index = joined(first.index[level.key])
            result.index[level.key].append(np.tile(index, repeats))
    for key, count in first.count.items():
        result.count[key] += repeats * count


def _levels(level: PlanLevel) -> Iterator[tuple[PlanLevel, PlanLevel]]:
    """Yield all levels inside of one, each with the one around it."""
    for step in level.steps:
        if isinstance(step, List):
            yield step.level, level
            yield from _levels(step.level)
