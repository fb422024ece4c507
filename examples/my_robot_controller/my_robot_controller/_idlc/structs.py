"""The introspection kind: rmw_cyclonedds_cpp and others that walk over C structures.

Message memory is what rosidl's is: the C structure, and what it refers to, all from
rosidl's allocator. So it does not matter whose type support a middleware works with where
it takes two of one type name for the same, idlc's or rosidl's.

The generated codec checks and encodes a message; here its bytes are moved into the
structure that rosidl's C generator would make for the type, and the other way, by type
description alone. Byte order is the machine's. Both sides align numbers to their size,
so most of a message moves in a few large runs.
"""

from __future__ import annotations

import ctypes
import sys
from array import array
from ctypes import PYFUNCTYPE, c_bool, c_size_t, c_void_p
from functools import cache
from struct import Struct
from typing import Any, NamedTuple

from . import c, introspection
from .c import RefusedError
from .cdr import HEADERS, NATIVE
from .codec import encode_error, functions
from .introspection import allocator, c_structure, element_type, placed_fields
from .typeinfo import SCALAR, FieldInfo, Structure

_HEADER = 4
_COUNT = Struct("=I")


@cache
def _runtime() -> tuple[Any, Any, Any]:
    """Return the functions that assign a string, and a wide one, and that give zeroed memory."""
    library = c.load_library("librosidl_runtime_c.so")
    assign = PYFUNCTYPE(c_bool, c_void_p, c_void_p, c_size_t)
    return (
        assign(("rosidl_runtime_c__String__assignn", library)),
        assign(("rosidl_runtime_c__U16String__assignn", library)),
        PYFUNCTYPE(c_void_p, c_size_t, c_size_t, c_void_p)(allocator().zero_allocate),
    )


class Run(NamedTuple):
    """Numbers that lie in C as they do in CDR."""

    offset: int
    size: int
    align: int


class Text(NamedTuple):
    """A string: data, size and capacity."""

    offset: int
    wide: bool


class Repeat(NamedTuple):
    """Elements of `stride` bytes, one after the other."""

    offset: int
    steps: tuple[Step, ...]
    stride: int
    number: int | None  #: none of a sequence, which has its own
    align: int  #: not 0 if elements are nothing but numbers without gaps


#: One piece of a structure that lies somewhere else in CDR.
Step = Run | Text | Repeat


class _Reader:
    """Moves CDR, from after the header on, to C memory that is zero."""

    def __init__(self, body: memoryview) -> None:
        self.data = body
        self.at = 0

    def take(self, size: int, align: int) -> memoryview:
        start = self.at + -self.at % align
        self.at = start + size
        return self.data[start : self.at]

    def numbers(self, address: int, size: int, align: int) -> None:
        c.MEMORY[address : address + size] = self.take(size, align)

    def count(self) -> int:
        return int(_COUNT.unpack(self.take(4, 4))[0])

    def text(self, address: int) -> None:
        text = bytes(self.take(self.count(), 1))[:-1]
        _demand(_runtime()[0](address, text, len(text)))

    def wide_text(self, address: int) -> None:
        count = self.count()
        units = array("H", self.take(4 * count, 1).cast("I"))
        units.append(0)  # an empty array has no address
        _demand(_runtime()[1](address, units.buffer_info()[0], count))

    def sequence(self, address: int, stride: int) -> tuple[int, int]:
        """Allocate the elements, of which no function of rosidl_runtime_c knows all sizes."""
        count = self.count()
        if not count:
            return 0, 0
        data = _runtime()[2](count, stride, None)
        _demand(bool(data))
        word = address >> 3
        c.WORDS[word] = data
        c.WORDS[word + 1] = c.WORDS[word + 2] = count
        return data, count


def _demand(done: bool) -> None:
    if not done:
        raise MemoryError


class _Writer:
    """Moves C memory to CDR, which begins with its header."""

    def __init__(self) -> None:
        self.out = bytearray(HEADERS[NATIVE])

    def put(self, data: bytes | memoryview, align: int) -> None:
        out = self.out
        out += bytes(-(len(out) - _HEADER) % align)
        out += data

    def numbers(self, address: int, size: int, align: int) -> None:
        self.put(c.MEMORY[address : address + size], align)

    def text(self, address: int) -> None:
        data, size = _data_and_size(address)
        self.put(_COUNT.pack(size + 1), 4)
        self.out += c.MEMORY[data : data + size].tobytes() + b"\0"

    def wide_text(self, address: int) -> None:
        """Write UTF-16 units, which take four bytes each in CDR and two in C."""
        data, size = self.sequence(address, 2)
        units = array("H", c.MEMORY[data : data + 2 * size].tobytes())
        self.out += array("I", units).tobytes()

    def sequence(self, address: int, _: int) -> tuple[int, int]:
        data, size = _data_and_size(address)
        self.put(_COUNT.pack(size), 4)
        return data, size


def _data_and_size(address: int) -> tuple[int, int]:
    """Return the first two members of a string or sequence."""
    return c.WORDS[address >> 3], c.WORDS[(address >> 3) + 1]


def _move(side: _Reader | _Writer, steps: tuple[Step, ...], bases: range) -> None:
    """Move the structures that begin at some addresses."""
    for base in bases:
        for step in steps:
            start = base + step.offset
            if isinstance(step, Run):
                side.numbers(start, step.size, step.align)
            elif isinstance(step, Text):
                (side.wide_text if step.wide else side.text)(start)
            else:
                _, inner, stride, number, align = step
                if number is None:
                    start, number = side.sequence(start, stride)
                if align and number:
                    side.numbers(start, number * stride, align)
                else:
                    _move(side, inner, range(start, start + number * stride, stride))


def _field_steps(field: FieldInfo, offset: int) -> tuple[Step, ...]:
    kind = element_type(field)
    stride = ctypes.sizeof(kind)
    inner: tuple[Step, ...]
    if field.nested:
        inner = steps(field.nested)
    elif field.text:
        inner = (Text(0, field.wide),)
    else:
        inner = (Run(0, stride, stride),)
    if field.shape == SCALAR:
        return tuple(step._replace(offset=step.offset + offset) for step in inner)
    first = inner[0]
    align = first.align if isinstance(first, Run) and first.size == stride else 0
    if field.size and align:
        return (Run(offset, field.size * stride, align),)
    return (Repeat(offset, inner, stride, field.size, align),)


@cache
def steps(structure: Structure) -> tuple[Step, ...]:
    """Return how a type moves, neighbouring runs joined."""
    joined: list[Step] = []
    for field, offset in placed_fields(structure):
        for step in _field_steps(field, offset):
            last = joined[-1] if joined else None
            # directly after another one, in C and always in CDR
            if (
                isinstance(step, Run)
                and isinstance(last, Run)
                and step.offset == last.offset + last.size
                and step.align <= last.align
                and last.size % step.align == 0
            ):
                joined[-1] = last._replace(size=last.size + step.size)
            else:
                joined.append(step)
    return tuple(joined)


def message(cls: Any, structure: Structure) -> tuple[int, ...]:
    """Return the addresses that rclpy reads from a message class, in their order."""
    encode = cls._codec_(NATIVE).encode
    _, decode = functions(cls)
    parts = steps(structure)

    def store(address: int, message: Any) -> None:
        try:
            data = encode(message, b"".join)
        except Exception as error:
            raise encode_error(message, sys.byteorder, error) from error
        _move(_Reader(memoryview(data)[_HEADER:]), parts, range(address, address + 1))

    def fetch(address: int) -> Any:
        side = _Writer()
        _move(side, parts, range(address, address + 1))
        return decode(side.out)

    # messages at addresses: `converter[address] = message` and `converter[address]`
    methods = {
        "__setitem__": staticmethod(store),
        "__getitem__": staticmethod(c.taking(structure.name, fetch)),
    }
    converter: Any = type("Converter", (), methods)()
    size = ctypes.sizeof(c_structure(structure))
    content = introspection.content(structure)
    try:
        addresses = introspection.memory_functions(size, content, converter)
        handle = introspection.handle(structure, functional=True)
    except RefusedError as error:
        raise ImportError(
            f"idlc's type support for this middleware needs machine code, but {error}: "
            "set RMW_IMPLEMENTATION to rmw_fastrtps_cpp, or build the interface package "
            "with colcon"
        ) from error
    names = ("create", "destroy", "convert_from_py", "convert_to_py")
    return *map(addresses.__getitem__, names), handle


def service(name: str, *handles: int) -> tuple[int, int]:
    """Return identifier and data of a service's type support, from its messages' handles."""
    members = [c.MessageTypeSupport.from_address(handle).data for handle in handles]
    names = c.namespace_and_name(name, "__")
    data = c.ServiceMembers(*names, (c_void_p * 3)(*members))
    return c.identifier(introspection.IDENTIFIER), c.pointer(data)
