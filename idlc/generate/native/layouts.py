"""The layouts of C structures, which differ between distributions of ROS 2."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from idlc.model import ir

STRING, WSTRING, MESSAGE = 16, 17, 18
#: The type ids of primitives in introspection.
TYPE_IDS = {
    "float32": 1, "float64": 2, "bool": 6, "byte": 7, "char": 8, "uint8": 8, "int8": 9,
    "uint16": 10, "int16": 11, "uint32": 12, "int32": 13, "uint64": 14, "int64": 15,
}  # fmt: skip


class StructLayout(NamedTuple):
    """Sizes and offsets in bytes, each of which can be measured with the headers."""

    members: int = 40  #: the offset of `members_` in MessageMembers
    member: int = 112  #: the size of a MessageMember
    is_array: int = 33  #: the offset of `is_array_` in it
    string: int = 24
    bool_sequence: int = 24
    primitive_sequence: int = 24
    string_sequence: int = 24
    message_sequence: int = 24

    def of_cpp(self) -> StructLayout:
        """Return the layout for C++ messages, with fields of libstdc++'s types.

        Offsets after a `uint8[]` are others in Lyrical: its own class for it has had another size
        in each version.
        """
        return self._replace(string=32, bool_sequence=40, primitive_sequence=24, string_sequence=24)


#: Sequences in C, other than of messages, have a flag here: their data are a buffer of Lyrical.
_LYRICAL = StructLayout(member=120, bool_sequence=32, primitive_sequence=32, string_sequence=32)
LAYOUTS = {
    "humble": StructLayout(members=32, is_array=32),
    "iron": StructLayout(members=32, is_array=32),
    "jazzy": StructLayout(),
    "kilted": StructLayout(),
    "lyrical": _LYRICAL,
    "rolling": _LYRICAL,
}


class Structure(NamedTuple):
    """A message's structure, as a compiler lays out what rosidl generates."""

    offsets: tuple[int, ...]
    size: int
    align: int


class Structures:
    """The structures of messages: `add` them with those first that others hold."""

    def __init__(self, layout: StructLayout) -> None:
        self._layout = layout
        self._structures: dict[ir.TypeName, Structure] = {}

    def add(self, name: ir.TypeName, fields: Iterable[ir.Field]) -> Structure:
        """Return the structure of a message."""
        offsets, end, most = [], 0, 1
        for field in fields:
            size, align = self._field(field.type)
            start = end + -end % align
            offsets.append(start)
            end, most = start + size, max(most, align)
        structure = Structure(tuple(offsets), end + -end % most, most)
        self._structures[name] = structure
        return structure

    def _field(self, type_: ir.FieldType) -> tuple[int, int]:
        """Return the size and alignment of a field."""
        layout, element = self._layout, ir.element_of(type_)
        match element:
            case ir.Primitive():
                size = align = element.info.size
                is_bool = element.name == "bool"
                sequence = layout.bool_sequence if is_bool else layout.primitive_sequence
            case ir.String():
                size, align, sequence = layout.string, 8, layout.string_sequence
            case ir.Ref():
                _, size, align = self._structures[element.target]
                sequence = layout.message_sequence
            case ir.Unknown():
                raise ValueError("an unknown type has no layout")
        if isinstance(type_, ir.Sequence):
            return sequence, 8
        return (size * type_.size if isinstance(type_, ir.Array) else size), align
