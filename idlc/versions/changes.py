"""Changes, and the pairing of two versions' elements: kept, renamed, moved, removed or added."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from typing import Generic, Literal, NamedTuple, TypeAlias, TypeVar

import msgspec

from idlc.diagnostics.codes import DiagnosticCode
from idlc.diagnostics.report import Diagnostic, Label
from idlc.diagnostics.source import Span
from idlc.model import ir

Level: TypeAlias = Literal["wire", "hash", "source", "behaviour"]

#: The levels that a change can break, the worst first: earlier bytes are misread or unreadable;
#: RIHS01 differs, so a middleware may not deliver messages between the two versions; Python or C++
#: code that used it fails; the same code behaves differently.
LEVELS: tuple[Level, ...] = ("wire", "hash", "source", "behaviour")


class Change(NamedTuple):
    """A difference that breaks something, with its range in the new version and in the old.

    `subject` is the changed element, such as `pkg/msg/Name.field`; `cause` is the other type whose
    change it follows from. A change without a `span` has the `path` of its file; `place` is the
    path of a missing file. `detail` is text of several lines.
    """

    code: DiagnosticCode
    subject: str
    message: str
    levels: frozenset[Level]
    span: Span | None = None
    old: Span | None = None
    path: str = ""
    hint: str | None = None
    cause: str = ""
    detail: str = ""
    place: str = ""

    def without(self, level: Level) -> Change:
        """Return the change without a level that does not apply after all."""
        return self._replace(levels=self.levels - {level})

    @property
    def diagnostic(self) -> Diagnostic:
        """The change as a problem to show."""
        label = (Label(self.old, "old version"),) if self.old and self.span else ()
        return Diagnostic(
            code=self.code.id,
            severity=self.code.severity,
            message=self.message,
            span=self.span,
            path=self.path,
            labels=label,
            hint=self.hint,
            detail=self.detail,
            place=self.place,
            levels=tuple(level for level in LEVELS if level in self.levels),
        )


def levels_of(changes: Iterable[Change]) -> str:
    """Return the levels that changes break, such as `wire, hash`; empty for none."""
    broken = {level for change in changes for level in change.levels}
    return ", ".join(level for level in LEVELS if level in broken)


T = TypeVar("T", bound=ir.Field | ir.Constant)


class Pairing(msgspec.Struct, Generic[T], frozen=True):
    """`kept` pairs have one name, `renamed` ones two; `moved` are names of kept elements."""

    kept: list[tuple[T, T]]
    renamed: list[tuple[T, T]]
    moved: frozenset[str]
    removed: list[T]
    added: list[T]


def pair(old: Sequence[T], new: Sequence[T], content: Callable[[T], Hashable]) -> Pairing[T]:
    """Return the elements of `old` paired with those of `new`; names in each must differ.

    An element that disappeared counts as renamed if one of the same content appeared in its
    place.
    """
    places = {element.name: place for place, element in enumerate(new)}
    common = [element for element in old if element.name in places]
    order = [places[element.name] for element in common]
    steady = {order[at] for at in _longest_increasing(order)}
    kept = [(element, new[places[element.name]]) for element in common]
    moved = frozenset(element.name for element in common if places[element.name] not in steady)
    renamed = list(_renamed(old, new, moved, content))
    paired = {id(element) for both in (*kept, *renamed) for element in both}
    removed, added = ([each for each in side if id(each) not in paired] for side in (old, new))
    return Pairing(kept, renamed, moved, removed, added)


def _longest_increasing(numbers: Sequence[int]) -> list[int]:
    """Return the positions of a longest increasing subsequence."""
    tails: list[int] = []
    ends: list[int] = []
    before: list[int | None] = []
    for at, number in enumerate(numbers):
        place = bisect_left(tails, number)
        before.append(ends[place - 1] if place else None)
        tails[place : place + 1] = [number]
        ends[place : place + 1] = [at]
    positions: list[int] = []
    step = ends[-1] if ends else None
    while step is not None:
        positions.append(step)
        step = before[step]
    return positions[::-1]


def _renamed(
    old: Sequence[T], new: Sequence[T], moved: frozenset[str], content: Callable[[T], Hashable]
) -> Iterator[tuple[T, T]]:
    """Yield the pairs of like elements in each gap between elements that kept name and order."""
    common = {element.name for element in old} & {element.name for element in new}
    gaps = zip(_split(old, common, moved), _split(new, common, moved), strict=True)
    for removed, added in gaps:
        candidates: dict[Hashable, deque[int]] = {}
        for at, other in enumerate(added):
            candidates.setdefault(content(other), deque()).append(at)
        first = 0
        for element in removed:
            like = candidates.get(content(element), deque())
            while like and like[0] < first:
                like.popleft()
            if like:
                first = like[0] + 1
                yield element, added[like[0]]


def _split(elements: Sequence[T], common: set[str], moved: frozenset[str]) -> Iterator[list[T]]:
    """Yield the runs of names without a counterpart between the steady ones."""
    gap: list[T] = []
    for element in elements:
        if element.name not in common:
            gap.append(element)
        elif element.name not in moved:
            yield gap
            gap = []
    yield gap


def without_bound(element: ir.Element) -> ir.Element:
    """Return an element that is equal for texts which differ only in their bounds."""
    return ir.String(element.wide) if isinstance(element, ir.String) else element


def native(type_: ir.FieldType) -> ir.FieldType:
    """Return a type that is equal for types that are one type in C++ and in Python.

    Bounds of arrays are part of the type in C++, those of strings are not.
    """
    element = without_bound(ir.element_of(type_))
    if element == ir.Primitive("char"):
        element = ir.Primitive("uint8")
    if isinstance(type_, (ir.Array, ir.Sequence)):
        return msgspec.structs.replace(type_, element=element)
    return element


def tighter(old: ir.Element, new: ir.Element) -> bool:
    """Return whether text that was allowed is too long now."""
    if not isinstance(old, ir.String) or not isinstance(new, ir.String):
        return False
    return new.bound is not None and (old.bound is None or new.bound < old.bound)
