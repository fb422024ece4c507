"""The C side of type support: structures, capsules, and callbacks that C may call.

Everything given to C must live as long as the process, so it goes through `keep`. An
exception that leaves a ctypes callback leaves the result *uninitialised*, so callbacks
whose result is a pointer are built from C callables only (`constant`, `resolver`): no
bytecode runs in them, hence no signal handler either. All others are made by
`callbacks`.
"""

from __future__ import annotations

import ctypes
import itertools
import operator
import struct
import sys
from ctypes import c_char, c_char_p, c_size_t, c_uint8, c_uint64, c_void_p, py_object
from typing import Any, NamedTuple, TypeVar

T = TypeVar("T")

_FOREVER: list[object] = []
# The module is torn down before the last C callback may come, so the list outlives its
# name.
ctypes.pythonapi.Py_IncRef(py_object(_FOREVER))


def keep(value: T) -> T:
    """Return `value`, which will never be freed."""
    _FOREVER.append(value)
    return value


class String(ctypes.Structure):
    """`rosidl_runtime_c__String` and its twin in type descriptions; `size` without the NUL."""

    _fields_ = (("data", c_char_p), ("size", c_size_t), ("capacity", c_size_t))


class Sequence(ctypes.Structure):
    """Any `X__Sequence`; `data` points to `size` elements."""

    _fields_ = (("data", c_void_p), ("size", c_size_t), ("capacity", c_size_t))


class FlaggedSequence(ctypes.Structure):
    """A sequence of numbers or strings since ROS 2 Lyrical; flags of zero mean as before."""

    _fields_ = (*Sequence._fields_, ("flags", c_uint64))


class FieldType(ctypes.Structure):
    """`rosidl_runtime_c__type_description__FieldType`."""

    _fields_ = (
        ("type_id", c_uint8),
        ("capacity", c_uint64),
        ("string_capacity", c_uint64),
        ("nested_type_name", String),
    )


class Field(ctypes.Structure):
    """`rosidl_runtime_c__type_description__Field`."""

    _fields_ = (("name", String), ("type", FieldType), ("default_value", String))


class IndividualDescription(ctypes.Structure):
    """`rosidl_runtime_c__type_description__IndividualTypeDescription`."""

    _fields_ = (("type_name", String), ("fields", Sequence))


class Description(ctypes.Structure):
    """`rosidl_runtime_c__type_description__TypeDescription`."""

    _fields_ = (("type_description", IndividualDescription), ("referenced", Sequence))


class Source(ctypes.Structure):
    """`rosidl_runtime_c__type_description__TypeSource`."""

    _fields_ = (
        ("type_name", String),
        ("encoding", String),
        ("raw_file_contents", String),
    )


class TypeHash(ctypes.Structure):
    """`rosidl_type_hash_t`; version 1 is RIHS01."""

    _fields_ = (("version", c_uint8), ("value", c_uint8 * 32))


class About(ctypes.Structure):
    """The three functions by which rcl asks for hash, description and sources: never NULL."""

    _fields_ = (
        ("type_hash", c_void_p),
        ("description", c_void_p),
        ("sources", c_void_p),
    )


class MessageTypeSupport(ctypes.Structure):
    """`rosidl_message_type_support_t`."""

    _fields_ = (
        ("identifier", c_void_p),
        ("data", c_void_p),
        ("func", c_void_p),
        ("about", About),
    )


class ServiceTypeSupport(ctypes.Structure):
    """`rosidl_service_type_support_t`."""

    _fields_ = (
        ("identifier", c_void_p),
        ("data", c_void_p),
        ("func", c_void_p),
        ("request", c_void_p),
        ("response", c_void_p),
        ("event", c_void_p),
        ("event_create", c_void_p),
        ("event_destroy", c_void_p),
        ("about", About),
    )


class ActionTypeSupport(ctypes.Structure):
    """`rosidl_action_type_support_t`."""

    _fields_ = (
        ("goal_service", c_void_p),
        ("result_service", c_void_p),
        ("cancel_service", c_void_p),
        ("feedback_message", c_void_p),
        ("status_message", c_void_p),
        ("about", About),
    )


def string(text: str) -> String:
    """Return `text` as a C string with a size; its bytes live as long as the structure."""
    data = text.encode()
    return String(data, len(data), len(data) + 1)


def sequence(items: list[Any], element: type[ctypes.Structure]) -> Sequence:
    """Return a sequence of copies of `items`, kept for ever."""
    array = keep((element * len(items))(*items))
    return Sequence(ctypes.addressof(array), len(items), len(items))


def pointer(value: ctypes.Structure) -> int:
    """Return the address of a structure that is kept."""
    return ctypes.addressof(keep(value))


def address(function: Any) -> int:
    """Return where the code of a foreign function or callback is; the callback is kept."""
    return ctypes.cast(keep(function), c_void_p).value or 0


def constant(pointer: int) -> int:
    """Return a C function that ignores its arguments and returns `pointer`."""
    return address(ctypes.PYFUNCTYPE(c_void_p)(itertools.repeat(pointer).__next__))


def resolver(answers: dict[bytes, int]) -> int:
    """Return the C function `f(handle, identifier)` that gives an answer, else NULL.

    A class attribute that is not a descriptor is called without `self`: the handle
    becomes an object whose `[identifier]` is `answers.get(identifier)`, all of it in C.
    """
    handle = keep(type("Handle", (c_void_p,), {"__getitem__": answers.get}))
    prototype = ctypes.PYFUNCTYPE(c_void_p, handle, c_char_p)
    return address(prototype(operator.getitem))


def load_library(name: str) -> ctypes.CDLL:
    """Return a shared library of ROS 2; raises ImportError that says what to do."""
    try:
        return ctypes.CDLL(name)
    except OSError as error:
        raise ImportError(
            f"{name} cannot be loaded ({error}): install ROS 2's rclpy and a middleware "
            "(for example `pip install ros-jazzy-rclpy ros-jazzy-rmw-fastrtps-cpp`), "
            "or source your ROS 2 installation first"
        ) from error


_new_capsule = ctypes.PYFUNCTYPE(py_object, c_void_p, c_char_p, c_void_p)(
    ("PyCapsule_New", ctypes.pythonapi)
)
_capsule_pointer = ctypes.PYFUNCTYPE(c_void_p, py_object, c_char_p)(
    ("PyCapsule_GetPointer", ctypes.pythonapi)
)
if sys.maxsize < 1 << 62:
    raise ImportError("idlc's type support needs a 64-bit Python")

#: All memory of the process, by address, as bytes and as words: `MEMORY[start:stop]`,
#: `WORDS[address >> 3]`. Slicing it is three times faster than calling into C. A slice of
#: CHARACTERS is a copy.
MEMORY = memoryview((c_uint8 * (1 << 62)).from_address(0)).cast("B")
WORDS = MEMORY.cast("Q")
CHARACTERS = (c_char * (1 << 62)).from_address(0)
#: Where the content of a `bytes` object begins, from its `id`; a terminating zero
#: follows it.
BYTES_OFFSET = bytes.__basicsize__ - 1


def capsule(pointer: int) -> object:
    """Return a capsule without a name, as rclpy expects them."""
    return keep(_new_capsule(pointer, None, None))


def capsule_pointer(value: object) -> int:
    """Return what a capsule without a name points to."""
    return int(_capsule_pointer(value, None))


def _c_true() -> object:
    """Return an object that C code takes for `true` where it expects a `bool`.

    A function of Python's C interface that stands in for a `bool` function returns a
    pointer, and the caller looks at its low byte, or (clang, aarch64) at the lowest bit
    only. So the object is put at an address that ends in 01; nothing ever frees it.
    Python 3.14 needs the lowest bit for itself: there the low byte is just not zero,
    which x86-64's gcc accepts.
    """
    if sys.version_info >= (3, 14):
        return next(number for number in range(256) if id(number) & 0xFF)
    room = keep(ctypes.create_string_buffer(0x200))
    start = (ctypes.addressof(room) | 0xFF) + 2
    immortal = 0xFFFF_FFFF if sys.version_info >= (3, 12) else 1 << 60
    MEMORY[start : start + 16] = struct.pack("QQ", immortal, id(object))
    return ctypes.cast(start, py_object).value


#: What `convert_from_py` returns: C reads it as `true` and never releases it.
TRUE = _c_true()


def c_function(name: str) -> int:
    """Return the address of a function of Python's own C interface."""
    return address(getattr(ctypes.pythonapi, name))


class MessageSupport(NamedTuple):
    """The type support of a message class, and the functions of its memory.

    All are addresses.
    """

    handle: int
    create: int
    destroy: int
    convert_from_py: int
    convert_to_py: int
