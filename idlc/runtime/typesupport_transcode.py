"""CDR bytes to C structures and back, by type description alone.

The generated codec checks and encodes a message; here its bytes are moved into the structure that
rosidl's C generator would make for the type, and the other way. Byte order is the machine's.
Both sides align numbers to their size, so most of a message moves in a few large runs. Memory
belongs to rosidl_runtime_c's allocator, because the middleware allocates and frees there too.
"""

from __future__ import annotations

import ctypes
from array import array
from ctypes import PYFUNCTYPE, c_bool, c_char_p, c_size_t, c_void_p
from functools import cache
from struct import Struct
from typing import Any, NamedTuple, Protocol

from . import typesupport_c as c
from . import typesupport_introspection as introspection
from .typesupport_descriptions import ARRAY, NESTED, SCALAR, Field, load

_HEADER = 4
_COUNT = Struct("=I")
#: data, size and capacity of a string or sequence.
_TRIPLE = Struct("=QQQ")
_WIDE = (18, 22)


class Area(NamedTuple):
    """Some C memory."""

    address: int
    view: memoryview


def area(address: int, size: int) -> Area:
    """Return writable memory."""
    return Area(address, c.view_memory(address, size, c.WRITE))


class Cursor:
    """Where reading from CDR has come to; positions count from after the header."""

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


class _Runtime(NamedTuple):
    """Functions of rosidl_runtime_c; `init` and `fini` do for any sequence, counted in bytes."""

    assign: Any
    assign_wide: Any
    init: Any
    fini: Any


@cache
def _runtime() -> _Runtime:
    library = introspection.load_library("librosidl_runtime_c.so")
    assign = PYFUNCTYPE(c_bool, c_void_p, c_char_p, c_size_t)
    assign_wide = PYFUNCTYPE(c_bool, c_void_p, c_void_p, c_size_t)
    return _Runtime(
        assign(("rosidl_runtime_c__String__assignn", library)),
        assign_wide(("rosidl_runtime_c__U16String__assignn", library)),
        PYFUNCTYPE(c_bool, c_void_p, c_size_t)(
            ("rosidl_runtime_c__uint8__Sequence__init", library)
        ),
        PYFUNCTYPE(None, c_void_p)(
            ("rosidl_runtime_c__uint8__Sequence__fini", library)
        ),
    )


class Step(Protocol):
    """Moves one piece; `base` is where the structure begins in its area."""

    def fill(self, cursor: Cursor, memory: Area, base: int) -> None:
        """Move from CDR to C memory that is zero."""

    def drain(self, memory: Area, base: int, out: bytearray) -> None:
        """Append to CDR what C memory holds."""

    def free(self, memory: Area, base: int) -> None:
        """Free what the piece has allocated."""


class Run:
    """Numbers that lie in C as they do in CDR."""

    def __init__(self, offset: int, size: int, align: int) -> None:
        self.offset, self.size, self.align = offset, size, align

    def fill(self, cursor: Cursor, memory: Area, base: int) -> None:  # noqa: D102
        start = base + self.offset
        memory.view[start : start + self.size] = cursor.take(self.size, self.align)

    def drain(self, memory: Area, base: int, out: bytearray) -> None:  # noqa: D102
        start = base + self.offset
        _put(out, memory.view[start : start + self.size], self.align)

    def free(self, memory: Area, base: int) -> None:  # noqa: D102
        pass


class Text:
    """A string."""

    def __init__(self, offset: int) -> None:
        self.offset = offset

    def fill(self, cursor: Cursor, memory: Area, base: int) -> None:  # noqa: D102
        text = bytes(cursor.take(cursor.count(), 1))[:-1]
        _demand(_runtime().assign(memory.address + base + self.offset, text, len(text)))

    def drain(self, memory: Area, base: int, out: bytearray) -> None:  # noqa: D102
        data, size, _ = _TRIPLE.unpack_from(memory.view, base + self.offset)
        _put(out, _COUNT.pack(size + 1), 4)
        out += (c.copy_memory(data, size) if size else b"") + b"\0"

    def free(self, memory: Area, base: int) -> None:  # noqa: D102
        _free(memory, base + self.offset)


class WideText(Text):
    """A wstring: UTF-16 units, four bytes each in CDR and two in C."""

    def fill(self, cursor: Cursor, memory: Area, base: int) -> None:  # noqa: D102
        count = cursor.count()
        units = array("H", cursor.take(4 * count, 1).cast("I"))
        units.append(0)  # never without an address
        start = units.buffer_info()[0]
        _demand(
            _runtime().assign_wide(memory.address + base + self.offset, start, count)
        )

    def drain(self, memory: Area, base: int, out: bytearray) -> None:  # noqa: D102
        data, size, _ = _TRIPLE.unpack_from(memory.view, base + self.offset)
        _put(out, _COUNT.pack(size), 4)
        if size:
            out += array("I", c.view_memory(data, 2 * size, c.READ).cast("H")).tobytes()


class Repeat:
    """A fixed number of structures or strings, one after the other."""

    def __init__(self, steps: list[Step], offset: int, count: int, stride: int) -> None:
        self.steps = steps
        self.starts = range(offset, offset + count * stride, stride)

    def fill(self, cursor: Cursor, memory: Area, base: int) -> None:  # noqa: D102
        for start in self.starts:
            for step in self.steps:
                step.fill(cursor, memory, base + start)

    def drain(self, memory: Area, base: int, out: bytearray) -> None:  # noqa: D102
        for start in self.starts:
            for step in self.steps:
                step.drain(memory, base + start, out)

    def free(self, memory: Area, base: int) -> None:  # noqa: D102
        for start in self.starts:
            for step in self.steps:
                step.free(memory, base + start)


class Many:
    """A sequence; `steps` move one element, which takes `stride` bytes."""

    def __init__(self, steps: list[Step], offset: int, stride: int) -> None:
        self.steps, self.offset, self.stride = steps, offset, stride
        only = steps[0] if len(steps) == 1 else None
        #: Alignment of the numbers, if the elements are nothing but numbers without gaps.
        self.align = only.align if isinstance(only, Run) and only.size == stride else 0

    def content(self, count: int) -> Step:
        """Return the step that moves `count` elements, from the first one on."""
        if self.align:
            return Run(0, count * self.stride, self.align)
        return Repeat(self.steps, 0, count, self.stride)

    def fill(self, cursor: Cursor, memory: Area, base: int) -> None:  # noqa: D102
        count = cursor.count()
        if count:
            content = allocate(memory.address + base + self.offset, count, self.stride)
            if not self.align:
                ctypes.memset(content.address, 0, count * self.stride)
            self.content(count).fill(cursor, content, 0)

    def drain(self, memory: Area, base: int, out: bytearray) -> None:  # noqa: D102
        data, count, _ = _TRIPLE.unpack_from(memory.view, base + self.offset)
        _put(out, _COUNT.pack(count), 4)
        if count:
            self.content(count).drain(area(data, count * self.stride), 0, out)

    def free(self, memory: Area, base: int) -> None:  # noqa: D102
        data, count, _ = _TRIPLE.unpack_from(memory.view, base + self.offset)
        if count:
            self.content(count).free(area(data, count * self.stride), 0)
        _free(memory, base + self.offset)


def _demand(done: bool) -> None:
    if not done:
        raise MemoryError


def allocate(sequence: int, count: int, stride: int) -> Area:
    """Give the empty sequence at an address `count` elements, not yet zero; return them."""
    _demand(_runtime().init(sequence, count * stride))
    data, *_ = words = (c_size_t * 3).from_address(sequence)
    words[1:] = (count, count)
    return area(data, count * stride)


def _free(memory: Area, start: int) -> None:
    """Free the data of a string or sequence."""
    if _TRIPLE.unpack_from(memory.view, start)[0]:
        _runtime().fini(memory.address + start)


def _element_steps(field: Field) -> list[Step]:
    """Return the steps of one element that begins at 0."""
    if field.base == NESTED:
        return list(steps(field.nested_type_name))
    kind = introspection.element_type(field)
    if kind is c.String:
        return [WideText(0) if field.base in _WIDE else Text(0)]
    return [Run(0, ctypes.sizeof(kind), ctypes.sizeof(kind))]


def _moved(step: Step, offset: int) -> Step:
    """Return a step whose structure begins `offset` bytes later; not for use with areas."""
    if isinstance(step, Run):
        return Run(step.offset + offset, step.size, step.align)
    return Repeat([step], offset, 1, 1)


def _field_steps(field: Field, offset: int) -> list[Step]:
    elements = _element_steps(field)
    stride = ctypes.sizeof(introspection.element_type(field))
    if field.shape == SCALAR:
        return [_moved(step, offset) for step in elements]
    if field.shape != ARRAY:
        return [Many(elements, offset, stride)]
    content = Many(elements, 0, stride).content(field.capacity)
    return [_moved(content, offset)]


@cache
def steps(name: str) -> tuple[Step, ...]:
    """Return how a type moves, neighbouring runs joined."""
    joined: list[Step] = []
    for field, offset in zip(load().types[name], introspection.offsets(name)):
        for step in _field_steps(field, offset):
            last = joined[-1] if joined else None
            if isinstance(step, Run) and isinstance(last, Run) and _follows(step, last):
                joined[-1] = Run(last.offset, last.size + step.size, last.align)
            else:
                joined.append(step)
    return tuple(joined)


def _follows(step: Run, last: Run) -> bool:
    """Return whether a run comes directly after another one, in C and always in CDR."""
    return (
        step.offset == last.offset + last.size
        and step.align <= last.align
        and last.size % step.align == 0
    )


def fill(name: str, body: memoryview, memory: Area) -> None:
    """Move a message from CDR without header into zeroed C memory."""
    cursor = Cursor(body)
    for step in steps(name):
        step.fill(cursor, memory, 0)


def drain(name: str, memory: Area, out: bytearray) -> None:
    """Append a message in C memory to CDR that has only the header so far."""
    for step in steps(name):
        step.drain(memory, 0, out)


def free(name: str, memory: Area) -> None:
    """Free all that a message in C memory owns."""
    for step in steps(name):
        step.free(memory, 0)
