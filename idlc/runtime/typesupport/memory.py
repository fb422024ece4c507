"""Message memory as rosidl has it, and the functions that know it: all in machine code.

They are what a middleware finds beside introspection members, and what rclpy makes and
frees messages with.
"""

from __future__ import annotations

import ctypes
from ctypes import c_size_t, c_void_p
from functools import cache
from typing import NamedTuple

from . import c
from . import machine_code as native
from .c_layout import element_type, placed_fields
from .descriptions import ARRAY, NESTED, SCALAR, Field


class Functions(NamedTuple):
    """Addresses of functions that know one type of message, and its sequences and arrays.

    `convert_from_py` and `convert_to_py` are the only ones that need Python: they call
    `converter[address] = message` and `converter[address]`.
    """

    create: int
    destroy: int
    convert_from_py: int
    convert_to_py: int
    finish: int
    resize: int
    length: int
    in_sequence: int
    in_array: int


@cache
def elements(size: int, content: int) -> Functions:
    """Return functions for all elements of a size and with a content to free."""
    return functions(size, content, None)


def functions(size: int, content: int, converter: object) -> Functions:
    """Return new functions; they live as long as the process."""
    allocate, deallocate = allocator()
    made = native.functions(
        "structs",
        {
            "allocate": allocate,
            "deallocate": deallocate,
            "set_item": c.c_function("PySequence_SetItem"),
            "get_item": c.c_function("PySequence_GetItem"),
            "converter": id(c.keep(converter)),
            "plan": content or _table(),
            "sequence": _table((0, 0, size, content)),
            "size": size,
        },
    )
    return Functions(*(made[name] for name in Functions._fields))


class _Allocator(ctypes.Structure):
    """`rcutils_allocator_t`."""

    _fields_ = tuple(
        (name, c_void_p)
        for name in ("allocate", "deallocate", "reallocate", "zero_allocate", "state")
    )


class Allocator(NamedTuple):
    """Addresses of the functions that give zeroed memory, and take memory back."""

    zeroed: int
    free: int


@cache
def allocator() -> Allocator:
    """Return the allocator that all of rosidl uses."""
    default = c.load_library("librcutils.so").rcutils_get_default_allocator
    default.restype = _Allocator
    made = default()
    return Allocator(made.zero_allocate, made.deallocate)


# What must be freed in a structure is told by a table of words: how many entries, and for
# each entry an offset, how many elements are there (none: they are in memory of their
# own, as the three words of a sequence or string tell), the size of an element, and the
# table of an element (none: there is nothing to free in it).


def _table(*entries: tuple[int, int, int, int]) -> int:
    words = [len(entries), *(word for entry in entries for word in entry)]
    return ctypes.addressof(c.keep((c_size_t * len(words))(*words)))


@cache
def content(name: str) -> int:
    """Return the table of a type, 0 if there is nothing to free in it."""
    entries = []
    for field, offset in placed_fields(name):
        inner = element_content(field)
        count = {SCALAR: 1, ARRAY: field.capacity}.get(field.shape, 0)
        if inner or not count:
            size = ctypes.sizeof(element_type(field))
            entries.append((offset, count, size, inner))
    return _table(*entries) if entries else 0


def element_content(field: Field) -> int:
    """Return the table of one element of a field, 0 if there is nothing to free in it."""
    if field.base == NESTED:
        return content(field.nested_type_name)
    return _text() if element_type(field) is c.String else 0


@cache
def _text() -> int:
    """Return the table of a string."""
    return _table((0, 0, 0, 0))
