"""The layouts of C structures in each distribution, and the machine code for each processor.

The code follows the calling convention of the processor's ABI.
"""

from __future__ import annotations

from collections.abc import Iterable
from struct import pack, pack_into, unpack_from
from typing import NamedTuple

from idlc.generate.native.elf import Machine
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


def _fill_x86_64(code: bytearray, at: int, address: int, target: int) -> None:
    """Fill the hole at `at` with the distance from the end of it."""
    pack_into("<i", code, at, target - address - 4)


X86_64 = Machine(
    number=62,
    relative=8,
    absolute=1,
    page=0x1000,
    # NT_GNU_PROPERTY_TYPE_0: GNU_PROPERTY_X86_FEATURE_1_AND is IBT and SHSTK
    properties=pack("<3I4s4I", 4, 16, 5, b"GNU", 0xC0000002, 4, 3, 0),
    # Assembled from tests/generate/native/code_x86_64.s.
    code={
        "resolve": (
            "f30f1efa4c8b4708498b104885d274214889f18a023a01751248ffc248ffc184"
            "c075f0498b4008488930c34983c010ebd731c0c366662e0f1f84000000000090"
        ),
        "same": "4889f18a023a01751148ffc248ffc184c075f04889374889f8c331c0c30f1f00",
        "knows": "f30f1efa488d1500000000e900000000",
        "get": "f30f1efa488d0500000000c30f1f4000",
        "refuse": "f30f1efa31c0c3660f1f840000000000",
        "unbounded": "f30f1efac6070031c0c3660f1f440000",
        "throw": "f30f1efa488d3d00000000ff250000000066662e0f1f8400000000000f1f4000",
        "nothing": "f30f1efac366662e0f1f840000000000",
    },
    # Where an address is missing in them, and of what.
    holes={
        "knows": {7: "identifier", 12: "function"},
        "get": {7: "target"},
        "throw": {7: "message", 13: "function"},
    },
    fill=_fill_x86_64,
)


def _fill_aarch64(code: bytearray, at: int, address: int, target: int) -> None:
    """Fill the instruction at `at`, as its kind wants it."""
    (word,) = unpack_from("<I", code, at)
    if word & 0x9F000000 == 0x90000000:  # adrp: by how many pages
        pages = (target >> 12) - (address >> 12)
        word |= (pages & 3) << 29 | (pages >> 2 & 0x7FFFF) << 5
    elif word & 0xFC000000 == 0x14000000:  # b: by how many instructions
        word |= target - address >> 2 & 0x3FFFFFF
    elif word & 0xFFC00000 == 0xF9400000:  # ldr: which word of the page
        word |= (target & 0xFFF) >> 3 << 10
    else:  # add: which byte of the page
        word |= (target & 0xFFF) << 10
    pack_into("<I", code, at, word)


AARCH64 = Machine(
    number=183,
    relative=1027,
    absolute=257,
    page=0x10000,
    # NT_GNU_PROPERTY_TYPE_0: GNU_PROPERTY_AARCH64_FEATURE_1_AND is BTI
    properties=pack("<3I4s4I", 4, 16, 5, b"GNU", 0xC0000000, 4, 1, 0),
    # Assembled from tests/generate/native/code_aarch64.s.
    code={
        "resolve": (
            "5f2403d5020440f9430040f9830100b4e40301aa6514403886144038bf00066b"
            "a100005485ffff35400440f9010000f9c0035fd642400091f4ffff17000080d2"
            "c0035fd61f2003d51f2003d51f2003d5"
        ),
        "same": (
            "e40301aa4514403886144038bf00066b8100005485ffff35010000f9c0035fd6"
            "000080d2c0035fd61f2003d51f2003d5"
        ),
        "knows": "5f2403d5020000904200009100000014",
        "get": "5f2403d50000009000000091c0035fd6",
        "refuse": "5f2403d5000080d2c0035fd61f2003d5",
        "unbounded": "5f2403d51f000039000080d2c0035fd6",
        "throw": "5f2403d5000000900000009110000090100240f900021fd61f2003d51f2003d5",
        "nothing": "5f2403d5c0035fd61f2003d51f2003d5",
    },
    # Where an address is missing in them, and of what.
    holes={
        "knows": {4: "identifier", 8: "identifier", 12: "function"},
        "get": {4: "target", 8: "target"},
        "throw": {4: "message", 8: "message", 12: "function", 16: "function"},
    },
    fill=_fill_aarch64,
)
