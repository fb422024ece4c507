"""The comparison of two versions of a structure on the wire: the new one may misread the old.

Plain CDR has no names and no lengths of structures: a reader depends on the offset of each number,
text and count, so a nested structure equals its fields in its place.
Padding is ignored when read and may hold anything; bytes that are left over at the end do no harm.

Both versions are followed through the bytes at once. The values before a value decide its padding,
and texts and sequences make distances variable, so every position modulo eight is followed.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Sequence
from typing import NamedTuple

from idlc.model import ir
from idlc.wire.layout import Messages

#: Arrays of more leaves than these stay one leaf.
EXPANDED = 64


class Leaf(NamedTuple):
    """A number, text, sequence or large array: its path from the top, and its type.

    The type of the dummy member, which is one byte, zero when written and ignored when read, is
    `None`. `align` is where it may begin; `size` its bytes, `None` for a size that varies.
    """

    path: str
    type: ir.Primitive | ir.String | ir.Sequence | ir.Array | None
    align: int = 1
    size: int | None = 1

    @property
    def least(self) -> int:
        """The least bytes that it takes."""
        if self.size is not None:
            return self.size
        return 5 if self.type == ir.String(wide=False) else 4


def structure(message: ir.Message, path: str, messages: Messages) -> Iterator[Leaf]:
    """Yield the leaves of a message."""
    for field in message.fields:
        yield from leaves(field.type, f"{path}.{field.name}", messages)
    if not message.fields:
        yield Leaf(f"{path}.", None)


def leaves(type_: ir.FieldType, path: str, messages: Messages) -> Iterator[Leaf]:
    """Yield the leaves of a field."""
    match type_:
        case ir.Ref():
            yield from structure(messages[type_.target], path, messages)
        case ir.Array():
            element = tuple(leaves(type_.element, "", messages))
            if type_.size * len(element) <= EXPANDED:
                for index in range(type_.size):
                    for leaf in element:
                        yield leaf._replace(path=f"{path}[{index}]{leaf.path}")
            else:
                yield Leaf(path, type_, element[0].align, None)
        case ir.Primitive():
            yield Leaf(path, type_, type_.info.size, type_.info.size)
        case ir.String() | ir.Sequence():
            yield Leaf(path, type_, 4, None)
        case ir.Unknown():
            raise ValueError("an unknown type has no bytes")


_OCTET = frozenset({"byte", "char", "uint8"})
_ONE_BYTE = _OCTET | {"bool", "int8"}
#: More bytes than padding and dummy members can bring one version ahead of the other.
_FAR = 16


class _Offset(NamedTuple):
    """Between two values: the old position modulo 8, and how far the new one is ahead of it."""

    at: int
    lead: int = 0


class _MisreadError(Exception):
    """The new version reads a value as something else; never leaves this module."""


def reads_alike(old: ir.Message, new: ir.Message, before: Messages, after: Messages) -> bool:
    """Return whether `new` reads every value of `old`, as bytes, without changing it.

    A field of the same name must get the same value, any other the value in its
    place; missing fields at the end do no harm, additional ones do.
    """
    runs = _Runs(tuple(structure(old, "", before)), tuple(structure(new, "", after)))
    return bool(_Follower(before, after).ends(runs, {_Offset(0)}, at_end=True))


def type_reads_alike(
    old: ir.FieldType, new: ir.FieldType, before: Messages, after: Messages, *, at_end: bool
) -> bool:
    """Return whether a field of one type, the last one or not, is read as it was by another."""
    runs = _Runs(tuple(leaves(old, "", before)), tuple(leaves(new, "", after)))
    ends = _Follower(before, after).ends(runs, {_Offset(at) for at in range(8)}, at_end=at_end)
    return bool(ends) and (at_end or all(not end.lead for end in ends))


class _Runs:
    """The same stretch of bytes as the two versions see it."""

    def __init__(self, old: Sequence[Leaf], new: Sequence[Leaf]) -> None:
        self.old = old
        self.new = new
        self.places = {leaf.path: at for at, leaf in enumerate(old) if leaf.type is not None}


def _aligned(at: int, align: int) -> int:
    return at + -at % align


class _Follower:
    """Follows two versions through the bytes."""

    def __init__(self, before: Messages, after: Messages) -> None:
        self._before = before
        self._after = after
        self._ends: dict[Hashable, set[_Offset]] = {}

    def ends(self, runs: _Runs, starts: Iterable[_Offset], *, at_end: bool) -> set[_Offset]:
        """Return the offsets after two runs; none if a value is misread."""
        try:
            return self.follow(runs, starts, at_end=at_end)
        except _MisreadError:
            return set()

    def follow(self, runs: _Runs, starts: Iterable[_Offset], *, at_end: bool) -> set[_Offset]:
        """Return the offsets after two runs; raise _MisreadError if a value is misread.

        `at_end` means that nothing is read after them.
        """
        states = {(0, place) for place in starts}
        last = max((at for at, leaf in enumerate(runs.new) if leaf.type is not None), default=0)
        for number, leaf in enumerate(runs.new):
            is_last = at_end and number >= last
            states = {
                after
                for next_old, place in states
                for after in self._step(runs, leaf, next_old, place, at_end=is_last)
            }
        return {_behind(runs.old[next_old:], place, at_end=at_end) for next_old, place in states}

    def _step(
        self, runs: _Runs, leaf: Leaf, next_old: int, place: _Offset, *, at_end: bool
    ) -> Iterable[tuple[int, _Offset]]:
        if abs(place.lead) > _FAR:
            raise _MisreadError
        if leaf.type is None:
            return [(next_old, place._replace(lead=place.lead + 1))]
        start = _aligned(place.at + place.lead, leaf.align)
        at = place.at
        for number in range(next_old, len(runs.old)):
            old = runs.old[number]
            at = _aligned(at, old.align)
            if at == start and runs.places.get(leaf.path, number) == number:
                ends = self._read(old, leaf, start, at_end=at_end)
                return [(number + 1, end) for end in ends]
            if old.size is None or at + old.size > start:
                break
            at += old.size
        raise _MisreadError

    def _read(self, old: Leaf, new: Leaf, start: int, *, at_end: bool) -> set[_Offset]:
        """Return the offsets after one value that both versions read at the same position."""
        match old.type, new.type:
            case ir.Primitive(name), ir.Primitive(later) if (
                name == later or {name, later} <= _OCTET or (name == "bool" and later in _ONE_BYTE)
            ):
                return {_Offset((start + old.least) % 8)}
            case None, ir.Primitive() if new.type.name in _ONE_BYTE:
                return {_Offset((start + 1) % 8)}
            case ir.String(), ir.String() if old.type.wide == new.type.wide:
                return {_Offset(at) for at in ((0, 4) if old.type.wide else range(8))}
            case ir.Sequence(), ir.Sequence() if _fits(old.type.bound, new.type.bound):
                key: Hashable = (old.type, new.type, start % 8, at_end)
                if key not in self._ends:
                    ends = self._sequence(old.type, new.type, (start + 4) % 8, at_end=at_end)
                    self._ends[key] = ends
                return self._ends[key]
            case ir.Array(), ir.Array() if old.type.size == new.type.size or (
                at_end and new.type.size < old.type.size
            ):
                key = (old.type, new.type, start % 8)
                if key not in self._ends:
                    self._ends[key] = self._array(old.type, new.type, start % 8)
                return self._ends[key]
        raise _MisreadError

    def _elements(self, old: ir.Element, new: ir.Element) -> _Runs:
        return _Runs(tuple(leaves(old, "", self._before)), tuple(leaves(new, "", self._after)))

    def _sequence(
        self, old: ir.Sequence, new: ir.Sequence, start: int, *, at_end: bool
    ) -> set[_Offset]:
        """Return the offsets after any number of elements that the old bound allows."""
        runs = self._elements(old.element, new.element)
        ends = {_Offset(start)}
        if at_end and all(leaf.type is None for leaf in runs.new):
            if sum(leaf.least for leaf in runs.old) < len(runs.new):
                raise _MisreadError
            return ends
        fresh = set(ends)
        count = 0
        while fresh and (old.bound is None or count < old.bound):
            fresh = self.follow(runs, fresh, at_end=at_end and old.bound == 1) - ends
            ends |= fresh
            count += 1
        return ends

    def _array(self, old: ir.Array, new: ir.Array, start: int) -> set[_Offset]:
        runs = self._elements(old.element, new.element)
        seen = [frozenset((_Offset(start),))]
        while len(seen) <= new.size:
            places = frozenset(self.follow(runs, seen[-1], at_end=False))
            if places in seen:  # from here on they repeat
                first = seen.index(places)
                return set(seen[first + (new.size - first) % (len(seen) - first)])
            seen.append(places)
        return set(seen[new.size])


def _behind(rest: Iterable[Leaf], place: _Offset, *, at_end: bool) -> _Offset:
    """Return the offset after old values that the new version does not read."""
    at = place.at
    for leaf in rest:
        if leaf.size is None and not at_end:
            raise _MisreadError
        at = _aligned(at, leaf.align) + leaf.least
    lead = place.at + place.lead - at
    if at_end and lead > 0:
        raise _MisreadError
    return _Offset(at % 8, lead)


def _fits(old: int | None, new: int | None) -> bool:
    """Return whether every length within one bound is within another."""
    return new is None or (old is not None and old <= new)
