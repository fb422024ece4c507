"""The layout of a structure on the wire, nested structures inlined (language 8).

In: a structure and all others by name. Out: a tuple of steps in wire order, each with the local
variable that holds its owner. Knows sizes and alignments; knows no Python text.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

import msgspec

from idlc.model import ir
from idlc.model.python_names import Locals, slot
from idlc.wire.layout import Messages


class Slot(msgspec.Struct, frozen=True):
    """The location of a value: a slot of the object in a local variable, of structure `type`.

    A value without an `owner` is only in its own variable. `path` has the names of all fields that
    lead to it, so that no other field changes it; `local` is the variable of the value.
    """

    owner: str
    slot: str
    path: str
    local: str
    type: ir.TypeName

    @property
    def text(self) -> str:
        """The expression that the value is assigned to."""
        return f"{self.owner}.{self.slot}" if self.owner else self.local


class Number(msgspec.Struct, frozen=True):
    """A bool, byte, integer or float; `code` as in `struct`."""

    place: Slot
    code: str
    size: int

    @property
    def unit(self) -> int:
        """The same bytes, at a multiple of which it begins."""
        return self.size


class Dummy(msgspec.Struct, frozen=True):
    """The zero byte of a structure without fields."""

    code: str = "x"
    unit: int = 1
    size: int = 1


class NumberBlock(msgspec.Struct, frozen=True):
    """A fixed-size array of bools, bytes or numbers, moved as bytes."""

    place: Slot
    primitive: str
    count: int

    @property
    def unit(self) -> int:
        """Bytes of one element."""
        return ir.PRIMITIVES[self.primitive].size

    @property
    def code(self) -> str:
        """The array in the layout of a Struct, where it is a number of bytes or numbers."""
        lists = self.primitive in LIST_PRIMITIVES
        return f"{self.count}{'B' if lists else ir.PRIMITIVES[self.primitive].code}"

    @property
    def size(self) -> int:
        """Bytes of all."""
        return self.unit * self.count

    @property
    def is_large(self) -> bool:
        """True for a buffer of its own, because one more copy of the bytes would be noticed."""
        return self.size > LARGE


class StringStep(msgspec.Struct, frozen=True):
    """A string or wstring."""

    place: Slot
    wide: bool


class NumbersStep(msgspec.Struct, frozen=True):
    """A sequence of numbers, moved as one buffer."""

    place: Slot
    primitive: str
    bound: int | None

    @property
    def unit(self) -> int:
        """Bytes of one element."""
        return ir.PRIMITIVES[self.primitive].size

    @property
    def info(self) -> ir.PrimitiveInfo:
        """The facts of an element's type."""
        return ir.PRIMITIVES[self.primitive]


class Bytes(msgspec.Struct, frozen=True):
    """A sequence of bools or bytes, a list in Python."""

    place: Slot
    primitive: str
    bound: int | None


class StringsStep(msgspec.Struct, frozen=True):
    """An array (`size`) or sequence of strings."""

    place: Slot
    wide: bool
    size: int | None
    bound: int | None


class Enter(msgspec.Struct, frozen=True):
    """A nested structure begins; the steps after it use its variable `place.local`."""

    place: Slot
    type: ir.TypeName
    empty: bool


class StructuresStep(msgspec.Struct, frozen=True):
    """An array (`size`) or sequence of structures; `body` has the steps of one, in `item`."""

    place: Slot
    type: ir.TypeName
    item: str
    body: tuple[Step, ...]
    size: int | None
    bound: int | None


#: Steps whose size is fixed: `code` is their code in a Struct, they begin at a multiple of `unit`.
Plain: TypeAlias = Number | Dummy | NumberBlock
Step: TypeAlias = Plain | StringStep | NumbersStep | Bytes | StringsStep | Enter | StructuresStep

#: The struct character where it is not the one of PRIMITIVES.
CODES = {"bool": "?", "byte": "c"}
#: Primitives whose arrays are lists in Python, and the runtime's word for such a list.
LIST_PRIMITIVES = {"bool": "flags", "byte": "octets"}
#: A fixed-size array of more bytes than this is not part of a Struct.
LARGE = 1024
#: Below this element count, setup costs more than it saves.
FEW = 4


def steps(
    message: ir.Message, messages: Messages, names: Locals, owner: str = "message", path: str = ""
) -> tuple[Step, ...]:
    """Return the steps of a structure whose object is in the variable `owner`.

    `path` has the names of the fields that lead to it.
    """
    if not message.fields:
        return (Dummy(),)
    plan: list[Step] = []
    for field in message.fields:
        inner = f"{path}_{field.name}" if path else field.name
        place = Slot(owner, slot(field.name), inner, names.field(inner), message.name)
        if isinstance(field.type, ir.Ref):
            nested = messages[field.type.target]
            plan.append(Enter(place, field.type.target, not nested.fields))
            plan += steps(nested, messages, names, place.local, inner)
        else:
            plan.append(step_of(field.type, place, messages, names))
    return tuple(plan)


def step_of(type_: ir.FieldType, place: Slot, messages: Messages, names: Locals) -> Step:
    """Return the step of a value that is not a single structure."""
    match type_:
        case ir.Primitive(name):
            return Number(place, CODES.get(name, type_.info.code), type_.info.size)
        case ir.String(wide):
            return StringStep(place, wide)
        case ir.Array(ir.Primitive(name), size):
            return NumberBlock(place, name, size)
        case ir.Sequence(ir.Primitive(name), bound):
            kind = Bytes if name in LIST_PRIMITIVES else NumbersStep
            return kind(place, name, bound)
        case ir.Array(element) | ir.Sequence(element):
            length = type_.size if isinstance(type_, ir.Array) else None
            bound = type_.bound if isinstance(type_, ir.Sequence) else None
            if isinstance(element, ir.String):
                return StringsStep(place, element.wide, length, bound)
            if isinstance(element, ir.Ref):
                item = names.new(f"{place.path}_item")
                body = steps(messages[element.target], messages, names, item, item)
                return StructuresStep(place, element.target, item, body, length, bound)
    raise ValueError(f"a type that cannot be emitted: {type_!r}")


def smallest(body: tuple[Step, ...]) -> int:
    """Return the least number of bytes that steps can take, padding not counted."""
    least = 0
    for step in body:
        match step:
            case Number() | Dummy() | NumberBlock():
                least += step.size
            case StringsStep(size=int(size)):
                least += 4 * size
            case StructuresStep(size=int(size)):
                least += size * smallest(step.body)
            case Enter():
                pass
            case _:
                least += 4
    return least


def walk(body: tuple[Step, ...]) -> Iterator[Step]:
    """Yield steps, each before those of its elements."""
    for step in body:
        yield step
        if isinstance(step, StructuresStep):
            yield from walk(step.body)


def widest(body: tuple[Step, ...]) -> int:
    """Return the widest alignment of all values, counts among them."""
    units = {
        step.unit for step in walk(body) if isinstance(step, (Number, NumberBlock, NumbersStep))
    }
    has_counts = any(
        not isinstance(step, (Number, NumberBlock, Dummy, Enter)) for step in walk(body)
    )
    return max(units | {4 if has_counts else 1})


def is_many(step: StructuresStep) -> bool:
    """Return whether there may be enough elements to make setup worth its cost."""
    most = step.bound if step.size is None else step.size
    return most is None or most > FEW


def is_text(body: tuple[Step, ...]) -> bool:
    """Return whether steps are strings, and structures of them, with only single bytes between."""
    for step in body:
        match step:
            case StringStep(wide=False) | Number(size=1) | Enter():
                pass
            case StructuresStep() if is_text(step.body):
                pass
            case _:
                return False
    return any(isinstance(step, (StringStep, StructuresStep)) for step in body)


class Fixed(msgspec.Struct, frozen=True):
    """Elements that repeat at a constant distance.

    `size` is the bytes of an element, `stride` its bytes with the padding before the next.
    """

    align: int
    size: int
    stride: int


def fixed(body: tuple[Step, ...]) -> Fixed | None:
    """Return how elements of these steps repeat, or None if that depends on their values."""
    at = 0
    align = 1
    first = 0
    for step in body:
        if isinstance(step, Enter):
            continue
        if not isinstance(step, (Number, Dummy, NumberBlock)):
            return None
        first = first or step.unit
        align = max(align, step.unit)
        at += -at % step.unit + step.size
    return Fixed(align, at, at + -at % align) if first == align else None
