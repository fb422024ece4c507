"""What a type's messages consist of, as steps that go over many messages at once.

A structure is a `Level`: its fields and those of the structures in it, one after the other.
Fields of fixed size that follow each other are one `Segment`, in which all is at the same
place in each message. What a sequence repeats is a level of its own.

Which columns there are, and how they nest, is a tree of nodes beside the steps. Steps and
nodes meet in keys: numbers under which a scan keeps what it finds.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple


class Leaf(NamedTuple):
    """Where the numbers of one column are in a segment.

    `repeats` has the count and distance in bytes of the arrays around them, outermost first.
    """

    key: int
    offset: int
    code: str
    repeats: tuple[tuple[int, int], ...] = ()


class Segment:
    """Bytes of fixed size: how they align, how many they are, which columns are in them."""

    def __init__(self, key: int, align: int) -> None:
        self.key = key
        self.align = align
        self.size = 0
        self.leaves: list[Leaf] = []


class Text(NamedTuple):
    """A string; without a key, nobody wants it."""

    key: int | None
    wide: bool


class List(NamedTuple):
    """A sequence, or an array whose elements are not of fixed size.

    An array has a `size`; `least` is the fewest bytes that an element can take.
    """

    key: int | None
    size: int | None
    bound: int | None
    least: int
    level: Level


class Level:
    """A structure, or what else a sequence repeats."""

    def __init__(self, key: int) -> None:
        self.key = key
        self.steps: list[Segment | Text | List] = []
        self.node: Node

    @cached_property
    def fixed(self) -> bool:
        """Whether its size depends on nothing but where it begins."""
        return all(isinstance(step, Segment) for step in self.steps)

    @cached_property
    def packed(self) -> Segment | None:
        """Its segment, if it is all there is and the next one follows without a gap."""
        first = self.steps[0]
        if len(self.steps) > 1 or not isinstance(first, Segment):
            return None
        return None if first.size % first.align else first

    @cached_property
    def narrow(self) -> bool:
        """Whether it consists of strings, and none of them is wide."""
        return all(isinstance(step, Text) and not step.wide for step in self.steps)

    @cached_property
    def wanted(self) -> bool:
        """Whether there is a column in it."""
        return any(map(is_wanted, self.steps))


def is_wanted(step: Segment | Text | List) -> bool:
    """Return whether there is a column in a step."""
    return bool(step.leaves) if isinstance(step, Segment) else step.key is not None


# nodes: the columns


class Numbers(NamedTuple):
    """Numbers, or arrays of `size` numbers."""

    key: int
    code: str
    size: int | None


class Strings(NamedTuple):
    """Strings."""

    text: Text


class Struct(NamedTuple):
    """Columns by name."""

    fields: dict[str, Node]


class Instant(NamedTuple):
    """A time or duration, of which numpy makes one number."""

    code: str
    seconds: Numbers
    nanoseconds: Numbers


class Lists(NamedTuple):
    """Sequences or arrays of something.

    An array has a `size`. One of fixed-size elements has no step of its own, but is part of
    the segment around it.
    """

    size: int | None
    step: List | None
    element: Node


Node = Numbers | Strings | Struct | Instant | Lists
