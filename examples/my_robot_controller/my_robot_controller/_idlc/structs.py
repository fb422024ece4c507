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
from ctypes import PYFUNCTYPE, c_bool, c_char_p, c_size_t, c_void_p
from functools import cache
from struct import Struct
from typing import Any

from . import c, introspection
from .c import RefusedError
from .cdr import HEADERS, NATIVE
from .codec import encode_error, functions
from .introspection import allocator, c_structure, element_type, placed_fields
from .typeinfo import ARRAY, SCALAR, FieldInfo, Structure

_HEADER = 4
_COUNT = Struct("=I")
#: The type ids of wide strings.
_WIDE = (18, 22)


class Cursor:
    """A position in CDR that reading advances, counted from after the header."""

    __slots__ = ("at", "data")

    def __init__(self, body: memoryview) -> None:
        self.data = body
        self.at = 0

    def take(self, size: int, align: int) -> memoryview:
        """Return the next `size` bytes, at a multiple of `align`."""
        start = self.at + -self.at % align
        self.at = start + size
        return self.data[start : self.at]

    def count(self) -> int:
        """Return the next uint32."""
        return int(_COUNT.unpack(self.take(4, 4))[0])


def _put(out: bytearray, data: bytes | memoryview, align: int) -> None:
    """Append `data` at a multiple of `align` after the header."""
    out += bytes(-(len(out) - _HEADER) % align)
    out += data


@cache
def _runtime() -> tuple[Any, Any, Any]:
    """Return the functions that assign a string, and a wide one, and that give zeroed memory."""
    library = c.load_library("librosidl_runtime_c.so")
    assign = PYFUNCTYPE(c_bool, c_void_p, c_char_p, c_size_t)
    assign_wide = PYFUNCTYPE(c_bool, c_void_p, c_void_p, c_size_t)
    return (
        assign(("rosidl_runtime_c__String__assignn", library)),
        assign_wide(("rosidl_runtime_c__U16String__assignn", library)),
        PYFUNCTYPE(c_void_p, c_size_t, c_size_t, c_void_p)(allocator().zero_allocate),
    )


class Run:
    """Numbers that lie in C as they do in CDR."""

    def __init__(self, offset: int, size: int, align: int) -> None:
        self.offset, self.size, self.align = offset, size, align

    def fill(self, cursor: Cursor, base: int) -> None:  # noqa: D102
        start = base + self.offset
        c.MEMORY[start : start + self.size] = cursor.take(self.size, self.align)

    def drain(self, base: int, out: bytearray) -> None:  # noqa: D102
        start = base + self.offset
        _put(out, c.MEMORY[start : start + self.size], self.align)


class Text:
    """A string: data, size and capacity."""

    def __init__(self, offset: int) -> None:
        self.offset = offset

    def fill(self, cursor: Cursor, base: int) -> None:  # noqa: D102
        text = bytes(cursor.take(cursor.count(), 1))[:-1]
        _demand(_runtime()[0](base + self.offset, text, len(text)))

    def drain(self, base: int, out: bytearray) -> None:  # noqa: D102
        data, size = _data_and_size(base + self.offset)
        _put(out, _COUNT.pack(size + 1), 4)
        out += c.MEMORY[data : data + size]
        out += b"\0"


class WideText(Text):
    """A wstring: UTF-16 units, four bytes each in CDR and two in C."""

    def fill(self, cursor: Cursor, base: int) -> None:  # noqa: D102
        count = cursor.count()
        units = array("H", cursor.take(4 * count, 1).cast("I"))
        units.append(0)  # an empty array has no address
        _demand(_runtime()[1](base + self.offset, units.buffer_info()[0], count))

    def drain(self, base: int, out: bytearray) -> None:  # noqa: D102
        data, size = _data_and_size(base + self.offset)
        _put(out, _COUNT.pack(size), 4)
        units = array("H", c.MEMORY[data : data + 2 * size].tobytes())
        out += array("I", units).tobytes()


class Repeat:
    """A fixed number of structures or strings, one after the other."""

    def __init__(self, steps: list[Step], offset: int, count: int, stride: int) -> None:
        self.steps = steps
        self.starts = range(offset, offset + count * stride, stride)

    def fill(self, cursor: Cursor, base: int) -> None:  # noqa: D102
        for start in self.starts:
            for step in self.steps:
                step.fill(cursor, base + start)

    def drain(self, base: int, out: bytearray) -> None:  # noqa: D102
        for start in self.starts:
            for step in self.steps:
                step.drain(base + start, out)


class Many:
    """A sequence; `steps` move one element, which takes `stride` bytes."""

    def __init__(self, steps: list[Step], offset: int, stride: int) -> None:
        self.steps, self.offset, self.stride = steps, offset, stride
        only = steps[0] if len(steps) == 1 else None
        gapless = isinstance(only, Run) and only.size == stride
        #: Alignment of the numbers, if the elements are nothing but numbers without
        #: gaps.
        self.align = only.align if isinstance(only, Run) and gapless else 0

    def content(self, count: int) -> Step:
        """Return the step that moves `count` elements, from the first one on."""
        if self.align:
            return Run(0, count * self.stride, self.align)
        return Repeat(self.steps, 0, count, self.stride)

    def fill(self, cursor: Cursor, base: int) -> None:  # noqa: D102
        count = cursor.count()
        if count:
            data = allocate(base + self.offset, count, self.stride)
            self.content(count).fill(cursor, data)

    def drain(self, base: int, out: bytearray) -> None:  # noqa: D102
        data, count = _data_and_size(base + self.offset)
        _put(out, _COUNT.pack(count), 4)
        if count:
            self.content(count).drain(data, out)


#: Moves one piece of a structure from CDR to C memory that is zero (`fill`), or back (`drain`);
#: `base` is the address of the structure.
Step = Run | Text | Repeat | Many


def _demand(done: bool) -> None:
    if not done:
        raise MemoryError


def _data_and_size(address: int) -> tuple[int, int]:
    """Return the first two members of a string or sequence."""
    return c.WORDS[address >> 3], c.WORDS[(address >> 3) + 1]


def allocate(sequence: int, count: int, stride: int) -> int:
    """Give an empty sequence `count` elements, all zero; return the address of the first.

    No function of rosidl_runtime_c does it: each knows one kind of sequence, and there are
    kinds of different sizes.
    """
    data = _runtime()[2](count, stride, None)
    _demand(bool(data))
    word = sequence >> 3
    c.WORDS[word] = data
    c.WORDS[word + 1] = c.WORDS[word + 2] = count
    return int(data)


def _element_steps(field: FieldInfo) -> list[Step]:
    """Return the steps of one element that begins at 0."""
    if field.nested:
        return list(steps(field.nested))
    kind = element_type(field)
    if kind is c.String:
        return [WideText(0) if field.base in _WIDE else Text(0)]
    return [Run(0, ctypes.sizeof(kind), ctypes.sizeof(kind))]


def _moved(step: Step, offset: int) -> Step:
    """Return a step for a structure that lies `offset` bytes further on."""
    if isinstance(step, Run):
        return Run(step.offset + offset, step.size, step.align)
    return Repeat([step], offset, 1, 1)


def _field_steps(field: FieldInfo, offset: int) -> list[Step]:
    elements = _element_steps(field)
    stride = ctypes.sizeof(element_type(field))
    if field.shape == SCALAR:
        return [_moved(step, offset) for step in elements]
    if field.shape == ARRAY:
        return [_moved(Many(elements, 0, stride).content(field.capacity), offset)]
    return [Many(elements, offset, stride)]


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
                joined[-1] = Run(last.offset, last.size + step.size, last.align)
            else:
                joined.append(step)
    return tuple(joined)


def _converter(cls: Any, structure: Structure) -> object:
    """Return an object that keeps messages at addresses: `[address] = message`, `[address]`."""
    encode = cls._codec_(NATIVE).encode
    _, decode = functions(cls)
    message_step = Repeat(list(steps(structure)), 0, 1, 1)

    def store(address: int, message: Any) -> None:
        try:
            data = encode(message, b"".join)
        except Exception as error:
            raise encode_error(message, sys.byteorder, error) from error
        message_step.fill(Cursor(memoryview(data)[_HEADER:]), address)

    def fetch(address: int) -> Any:
        data = bytearray(HEADERS[NATIVE])
        message_step.drain(address, data)
        return decode(data)

    methods = {
        "__setitem__": staticmethod(store),
        "__getitem__": staticmethod(c.taking(structure.name, fetch)),
    }
    return type("Converter", (), methods)()


def message(cls: Any, structure: Structure) -> c.MessageSupport:
    """Return what rclpy needs to publish and take messages of a class."""
    size = ctypes.sizeof(c_structure(structure))
    content = introspection.content(structure)
    try:
        converter = _converter(cls, structure)
        addresses = introspection.memory_functions(size, content, converter)
        handle = introspection.handle(structure, functional=True)
    except RefusedError as error:
        raise ImportError(
            f"idlc's type support for this middleware needs machine code, but {error}: "
            "set RMW_IMPLEMENTATION to rmw_fastrtps_cpp, or build the interface package "
            "with colcon"
        ) from error
    names = ("create", "destroy", "convert_from_py", "convert_to_py")
    return c.MessageSupport(handle, *map(addresses.__getitem__, names))


#: `rosidl_typesupport_introspection_c__ServiceMembers`.
_ServiceMembers = c.structure(
    "ServiceMembers",
    namespace=c_char_p,
    name=c_char_p,
    request=c_void_p,
    response=c_void_p,
    event=c_void_p,
)


def service(name: str, *handles: int) -> tuple[int, int]:
    """Return identifier and data of a service's type support, from its messages' handles."""
    package, kind, short = name.split("/")
    members = [
        c.MessageTypeSupport.from_address(handle).data if handle else None
        for handle in handles
    ]
    data = _ServiceMembers(f"{package}__{kind}".encode(), short.encode(), *members)
    return introspection.library()[0], c.pointer(data)
