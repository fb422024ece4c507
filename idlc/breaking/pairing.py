"""Which elements of two versions are the same: kept, renamed, moved, removed or added."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar


class Named(Protocol):
    """Something that is known by its name."""

    @property
    def name(self) -> str:
        """The name."""


T = TypeVar("T", bound=Named)


@dataclass(frozen=True)
class Pairing(Generic[T]):
    """`kept` pairs have one name, `renamed` ones two; `moved` are names of kept elements."""

    kept: list[tuple[T, T]]
    renamed: list[tuple[T, T]]
    moved: frozenset[str]
    removed: list[T]
    added: list[T]


def pair(old: Sequence[T], new: Sequence[T], content: Callable[[T], Hashable]) -> Pairing[T]:
    """Return what became of the elements of `old`, whose names must differ, in those of `new`.

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
    gone = {id(one) for one, _ in renamed}
    come = {id(one) for _, one in renamed}
    names = {element.name for element in common}
    return Pairing(
        kept,
        renamed,
        moved,
        [one for one in old if one.name not in names and id(one) not in gone],
        [one for one in new if one.name not in names and id(one) not in come],
    )


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
    found: list[int] = []
    step = ends[-1] if ends else None
    while step is not None:
        found.append(step)
        step = before[step]
    return found[::-1]


def _renamed(
    old: Sequence[T], new: Sequence[T], moved: frozenset[str], content: Callable[[T], Hashable]
) -> Iterator[tuple[T, T]]:
    """Yield the pairs of like elements in each gap between those that kept name and order."""
    for gone, come in _gaps(old, new, moved):
        candidates: dict[Hashable, deque[int]] = {}
        for at, other in enumerate(come):
            candidates.setdefault(content(other), deque()).append(at)
        first = 0
        for one in gone:
            like = candidates.get(content(one), deque())
            while like and like[0] < first:
                like.popleft()
            if like:
                first = like[0] + 1
                yield one, come[like[0]]


def _gaps(
    old: Sequence[T], new: Sequence[T], moved: frozenset[str]
) -> Iterator[tuple[list[T], list[T]]]:
    common = {element.name for element in old} & {element.name for element in new}
    return zip(_split(old, common, moved), _split(new, common, moved), strict=True)


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
