"""The plan of a type: the steps by which many of its messages are scanned at once.

A structure is a `Level`: its fields and those of the structures in it, one after the other.
Fields of fixed size that follow each other are one `Segment`, in which all is at the same
place in each message. What a sequence repeats is a level of its own.

Which columns there are, and how they nest, is a tree of nodes beside the steps. Steps and
nodes meet in keys: numbers under which a scan keeps what it finds.

`plan_of` makes the plan of a type, or of some of its fields.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from itertools import count
from typing import Any, NamedTuple

from idlc.runtime.typeinfo import FieldInfo, Structure, least_element, spelling_hint


class SegmentLeaf(NamedTuple):
    """The place of the numbers of one column in a segment.

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
        self.leaves: list[SegmentLeaf] = []


class Text(NamedTuple):
    """A string, or the column of these; without a key, nobody wants it."""

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
    level: PlanLevel


class PlanLevel:
    """A structure, or what else a sequence repeats."""

    def __init__(self, key: int) -> None:
        self.key = key
        #: False if its last steps are left out, because nobody wants what they read.
        self.whole = True
        self.steps: list[Segment | Text | List] = []
        self.node: PlanNode

    @cached_property
    def fixed(self) -> bool:
        """True if its size depends on nothing but its position."""
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
        """True if it consists of strings, none of them wide."""
        return all(isinstance(step, Text) and not step.wide for step in self.steps)

    @cached_property
    def wanted(self) -> bool:
        """True if a column is read from it."""
        return any(map(is_wanted, self.steps))


def is_wanted(step: Segment | Text | List) -> bool:
    """Return whether a column is read from a step."""
    return bool(step.leaves) if isinstance(step, Segment) else step.key is not None


# nodes: the columns


class Numbers(NamedTuple):
    """Numbers, or arrays of `size` numbers."""

    key: int
    code: str
    size: int | None


class Struct(NamedTuple):
    """Columns by name; `times` has numpy's code of those that are times or durations."""

    fields: dict[str, PlanNode]
    times: dict[str, str]


class Lists(NamedTuple):
    """Sequences or arrays of something.

    An array has a `size`. One of fixed-size elements has no step of its own, but is part of
    the segment around it.
    """

    size: int | None
    step: List | None
    element: PlanNode


PlanNode = Numbers | Text | Struct | Lists


# the plan of a type

#: Sizes beyond it are beyond any buffer, and beyond what numpy calculates with.
MOST_BYTES = 1 << 50

#: What is wanted of a field: all (None), nothing, or some of its own fields.
Wanted = dict[str, Any] | None
NOTHING: dict[str, Any] = {}

#: Times that can become numpy's: by their type, what numpy calls the result.
_INSTANTS = {"builtin_interfaces/msg/Time": "M8[ns]", "builtin_interfaces/msg/Duration": "m8[ns]"}
#: Their fields, with type ids: a recording may define something else by these names.
_SECONDS = [("sec", 6), ("nanosec", 7)]


def code_of_time(structure: Structure) -> str | None:
    """Return numpy's code of a time or duration, `None` for other types."""
    fields = [(field.name, field.type_id) for field in structure.fields]
    return _INSTANTS.get(structure.name) if fields == _SECONDS else None


@lru_cache(maxsize=64)
def plan_of(structure: Structure, fields: tuple[str, ...] | None) -> PlanLevel:
    """Return the plan of a type; raise ValueError for a field that it does not have."""
    wanted = None if fields is None else _selection(structure, fields)
    builder = _Builder(count(), aligned=8)
    level = builder.level
    level.node = builder.structure(structure, wanted)
    # what comes after the last column matters to nobody
    while fields is not None and level.steps and not is_wanted(level.steps[-1]):
        level.steps.pop()
        level.whole = False
    return level


def _selection(structure: Structure, fields: tuple[str, ...]) -> dict[str, Any]:
    """Return dotted names as a tree."""
    tree: dict[str, Any] = {}
    for field in fields:
        inside: Structure | None = structure
        *outer, last = field.split(".")
        for step in (*outer, last):
            fields_inside = () if inside is None else inside.fields
            nested = {info.name: info.nested for info in fields_inside}
            if step not in nested:
                hint = spelling_hint(step, list(nested))
                raise ValueError(f"{structure.name} has no field {field!r}{hint}")
            inside = nested[step]
        at: Any = tree
        for step in outer:
            at = {} if at is None else at.setdefault(step, {})
        if at is not None:  # else all around it is wanted anyway
            at[last] = None
    return tree


def _numpy_code(kind: str, width: int) -> str:
    """Return numpy's code of a number, without a byte order, by that of `struct`."""
    if kind == "c":
        return "u1"
    if kind == "?":
        return "?"
    if kind in "fd":
        return f"f{width}"
    return f"i{width}" if kind.islower() else f"u{width}"


class _Builder:
    """Makes one level, step by step.

    The next value begins at `at` modulo `aligned`; nothing more is known of its position.
    """

    def __init__(self, keys: Any, aligned: int = 1) -> None:
        self.keys = keys
        self.level = PlanLevel(next(keys))
        self.segment: Segment | None = None
        self.aligned = aligned
        self.at = 0

    def structure(self, structure: Structure, wanted: Wanted) -> Struct:
        """Plan a structure."""
        if not structure.fields:
            self.place(1, 1)
        nodes: dict[str, PlanNode] = {}
        times: dict[str, str] = {}
        for field in structure.fields:
            inner = None if wanted is None else wanted.get(field.name, NOTHING)
            node = self.field(field, inner)
            if inner != NOTHING:
                nodes[field.name] = node
            code = code_of_time(field.nested) if inner is None and field.nested else None
            if code:
                times[field.name] = code
        return Struct(nodes, times)

    def field(self, field: FieldInfo, wanted: Wanted) -> PlanNode:
        """Plan a field."""
        if not field.is_list:
            return self.element(field, wanted)
        if field.primitive is not None and field.size is not None:
            return self.numbers(field, wanted, field.size)
        inside = _Builder(self.keys)
        level = inside.level
        level.node = inside.element(field, wanted)
        packed = level.packed
        if packed and field.size is not None:
            segment, offset = self.place(packed.align, field.size * packed.size)
            for leaf in packed.leaves:
                repeats = ((field.size, packed.size), *leaf.repeats)
                segment.leaves.append(leaf._replace(offset=offset + leaf.offset, repeats=repeats))
            return Lists(field.size, None, level.node)
        key = None if wanted == NOTHING else next(self.keys)
        least = min(least_element(field), MOST_BYTES)
        step = List(key, field.size, field.bound, least, level)
        self.add(step, min(4, packed.align) if packed else 1)
        return Lists(field.size, step, level.node)

    def element(self, field: FieldInfo, wanted: Wanted) -> PlanNode:
        """Plan a single value."""
        if field.nested:
            return self.structure(field.nested, wanted)
        if field.primitive is not None:
            return self.numbers(field, wanted)
        text = Text(None if wanted == NOTHING else next(self.keys), field.wide)
        self.add(text, 4 if field.wide else 1)
        return text

    def numbers(self, field: FieldInfo, wanted: Wanted, size: int | None = None) -> PlanNode:
        """Plan a number, or an array of them."""
        assert field.primitive is not None
        kind, width, key = field.primitive.code, field.primitive.size, next(self.keys)
        segment, offset = self.place(width, width * (1 if size is None else size))
        code = _numpy_code(kind, width)
        if wanted is None:
            segment.leaves.append(
                SegmentLeaf(key, offset, code, () if size is None else ((size, width),))
            )
        return Numbers(key, code, size)

    def place(self, align: int, size: int) -> tuple[Segment, int]:
        """Plan bytes of fixed size; return where they are."""
        if align > self.aligned:
            self.segment, self.aligned, self.at = None, align, 0
        start = self.at + -self.at % align
        if self.segment is None:
            self.segment = Segment(next(self.keys), align)
            self.level.steps.append(self.segment)
            offset = 0
        else:
            offset = self.segment.size + start - self.at
        self.segment.size = min(offset + size, MOST_BYTES)
        self.at = start + size
        return self.segment, offset

    def add(self, step: Text | List, aligned: int) -> None:
        """Add a step that is not of fixed size."""
        self.level.steps.append(step)
        self.segment, self.aligned, self.at = None, aligned, 0
