"""Functions that a middleware may call wherever it is, because no Python runs in them.

A middleware calls what a type support holds while it has locks of its own, and from any
thread. Whoever waits there for the interpreter's lock, or gives it away, can wait for
ever for a thread that wants such a lock. So these functions are machine code, which is
made, for each type, of a few hundred bytes that are the same for all, and some words.
"""

from __future__ import annotations

import ctypes
import os
from ctypes import c_int, c_size_t, c_ssize_t, c_void_p
from functools import cache
from importlib import import_module
from struct import pack
from types import ModuleType
from typing import NamedTuple

from . import typesupport_c as c
from .typesupport_descriptions import ARRAY, NESTED, SCALAR, Field
from .typesupport_layout import element_type, placed_fields

#: Machines that there is code for; the modules are called after them.
_MACHINES = ("x86_64", "aarch64")
_MAP_PRIVATE = 2
_READ_AND_EXECUTE = 1 | 4


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


class Words(NamedTuple):
    """What the machine code reads, in the order in which it follows the code."""

    allocate: int
    deallocate: int
    set_item: int
    get_item: int
    converter: int
    plan: int
    sequence: int
    size: int


@cache
def elements(size: int, content: int) -> Functions:
    """Return functions for all elements of a size and with a content to free."""
    return functions(size, content, None)


def functions(size: int, content: int, converter: object) -> Functions:
    """Return new functions; they live as long as the process."""
    machine = _machine()
    words = Words(
        *_allocator(),
        set_item=c.c_function("PySequence_SetItem"),
        get_item=c.c_function("PySequence_GetItem"),
        converter=id(c.keep(converter)),
        plan=content or _table(),
        sequence=_table((0, 0, size, content)),
        size=size,
    )
    start = _executable(machine.CODE + pack(f"={len(words)}Q", *words))
    return Functions(*(start + machine.ENTRIES[key] for key in Functions._fields))


def _machine() -> ModuleType:
    """Return the code for this machine."""
    machine = os.uname().machine
    if machine not in _MACHINES:
        raise _refusal(f"there is none for {machine}")
    return import_module(f"{__package__}.typesupport_{machine}")


def _refusal(reason: str) -> ImportError:
    return ImportError(
        f"idlc's type support for this middleware needs machine code, but {reason}: set "
        "RMW_IMPLEMENTATION to rmw_fastrtps_cpp, or build the interface package with "
        "colcon"
    )


def _executable(code: bytes) -> int:
    """Return where `code` can be executed: a file in memory, never writable where it is.

    That is allowed on more systems than to make memory executable that was written to.
    """
    library = ctypes.CDLL(None, use_errno=True)
    library.mmap.restype = c_ssize_t
    library.mmap.argtypes = (c_void_p, c_size_t, c_int, c_int, c_int, c_ssize_t)
    try:
        file = os.memfd_create("idlc")
    except (AttributeError, OSError) as error:
        raise _refusal(f"this system does not allow it ({error})") from error
    try:
        os.write(file, code)
        start = library.mmap(None, len(code), _READ_AND_EXECUTE, _MAP_PRIVATE, file, 0)
    finally:
        os.close(file)
    if start == -1:
        reason = os.strerror(ctypes.get_errno())
        raise _refusal(f"this system does not allow it ({reason})")
    return int(start)


class _Allocator(ctypes.Structure):
    """`rcutils_allocator_t`."""

    _fields_ = tuple(
        (name, c_void_p)
        for name in ("allocate", "deallocate", "reallocate", "zero_allocate", "state")
    )


@cache
def _allocator() -> tuple[int, int]:
    """Return the functions that give zeroed memory and take it, as all of rosidl does."""
    default = c.load_library("librcutils.so").rcutils_get_default_allocator
    default.restype = _Allocator
    allocator = default()
    return allocator.zero_allocate, allocator.deallocate


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
