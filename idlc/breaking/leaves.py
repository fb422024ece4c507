"""A structure as the flat run of what stands in its bytes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple, TypeAlias

from idlc.model import ir

Messages: TypeAlias = Mapping[ir.TypeName, ir.Message]

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
            if type_.size * _count(type_.element, messages) <= EXPANDED:
                for index in range(type_.size):
                    yield from leaves(type_.element, f"{path}[{index}]", messages)
            else:
                first = next(leaves(type_.element, "", messages))
                yield Leaf(path, type_, first.align, None)
        case ir.Primitive():
            yield Leaf(path, type_, type_.info.size, type_.info.size)
        case ir.String() | ir.Sequence():
            yield Leaf(path, type_, 4, None)
        case ir.Unknown():
            raise ValueError("an unknown type has no bytes")


def _count(type_: ir.FieldType, messages: Messages) -> int:
    match type_:
        case ir.Array():
            return type_.size * _count(type_.element, messages)
        case ir.Ref():
            fields = messages[type_.target].wire_fields
            return sum(_count(field.type, messages) for field in fields)
        case _:
            return 1
