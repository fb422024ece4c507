"""Introspection members, and message memory as rosidl has it.

Members are field names, types and C offsets, as a middleware walks them. Both kinds of
type support need them. Fast DDS describes types to its peers from them and never looks
at the memory; introspection-based middlewares read and write the memory that they
describe, with the functions that stand beside it. These, and those by which rclpy makes
and frees messages, are machine code.
"""

from __future__ import annotations

import ctypes
from ctypes import c_bool, c_char_p, c_size_t, c_uint8, c_uint32, c_void_p
from functools import cache
from typing import Any, NamedTuple

from . import c, machine_code
from .abi import abi, element_type, introspection_id, placed_fields, structure
from .descriptions import ARRAY, BOUNDED_SEQUENCE, NESTED, SCALAR, Field, about

IDENTIFIER = "rosidl_typesupport_introspection_c"


@cache
def _member_type() -> Any:
    """Return `rosidl_typesupport_introspection_c__MessageMember` of this ROS 2."""
    layout = abi()
    fields = (
        ("name", c_char_p),
        ("type_id", c_uint8),
        ("string_upper_bound", c_size_t),
        ("members", c_void_p),
        ("flags", c_uint8 * (layout.is_array - 32)),  # whether it is a key
        ("is_array", c_bool),
        ("array_size", c_size_t),
        ("is_upper_bound", c_bool),
        ("offset", c_uint32),
        ("default_value", c_void_p),
        ("size_function", c_void_p),
        ("get_const_function", c_void_p),
        ("get_function", c_void_p),
        ("fetch_function", c_void_p),
        ("assign_function", c_void_p),
        ("resize_function", c_void_p),
        ("later", c_uint8 * (layout.member - 112)),  # whether it is a buffer
    )
    return type("MessageMember", (ctypes.Structure,), {"_fields_": fields})


@cache
def _members_type() -> Any:
    """Return `rosidl_typesupport_introspection_c__MessageMembers` of this ROS 2."""
    fields = (
        ("namespace", c_char_p),
        ("name", c_char_p),
        ("count", c_uint32),
        ("size_of", c_size_t),
        ("flags", c_uint8 * (abi().members - 32)),  # whether there is a key
        ("members", c_void_p),
        ("init_function", c_void_p),
        ("fini_function", c_void_p),
    )
    return type("MessageMembers", (ctypes.Structure,), {"_fields_": fields})


class Library(NamedTuple):
    """Addresses in ROS 2's own libraries."""

    identifier: int
    same_handle: int
    same_service: int


@cache
def library() -> Library:
    """Return addresses in the libraries that define what introspection is.

    The identifier is rosidl's own string, because middlewares compare the pointers.
    `same_handle` and `same_service` answer with the handle itself if the identifier
    fits.
    """
    introspection = c.load_library(f"lib{IDENTIFIER}.so")
    runtime = c.load_library("librosidl_runtime_c.so")
    return Library(
        c_void_p.in_dll(introspection, f"{IDENTIFIER}__identifier").value or 0,
        c.address(runtime.get_message_typesupport_handle_function),
        c.address(runtime.get_service_typesupport_handle_function),
    )


def _member(field: Field, offset: int, functional: bool) -> Any:
    """Return the member that describes a field to the middleware."""
    member = _member_type()(
        name=field.name.encode(),
        type_id=introspection_id(field),
        string_upper_bound=field.string_capacity,
        is_array=field.shape != SCALAR,
        array_size=field.capacity,
        is_upper_bound=field.shape == BOUNDED_SEQUENCE,
        offset=offset,
    )
    if field.base == NESTED:
        member.members = handle(field.nested_type_name, functional)
    if field.shape != SCALAR and functional:
        size = ctypes.sizeof(element_type(field))
        functions = elements(size, element_content(field))
        if field.shape == ARRAY:
            member.get_function = functions.in_array
        else:
            member.size_function = functions.length
            member.get_function = functions.in_sequence
            member.resize_function = functions.resize
        member.get_const_function = member.get_function
    return member


def members(name: str, functional: bool) -> Any:
    """Return a message's members."""
    placed = placed_fields(name)
    table = [_member(field, offset, functional) for field, offset in placed]
    size = ctypes.sizeof(structure(name))
    finish = elements(size, content(name)).finish if functional else None
    package, kind, short = name.split("/")
    return c.keep(
        _members_type()(
            namespace=f"{package}__{kind}".encode(),
            name=short.encode(),
            count=len(table),
            size_of=size,
            members=c.sequence(table, _member_type()).data,
            fini_function=finish,
        )
    )


@cache
def handle(name: str, functional: bool) -> int:
    """Return the address of a message's introspection type support.

    `functional`: with the functions by which message memory is written and read.
    """
    support = c.MessageTypeSupport(
        library().identifier,
        ctypes.addressof(members(name, functional)),
        library().same_handle,
        about(name),
    )
    return c.pointer(support)


# message memory


class MemoryFunctions(NamedTuple):
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
def elements(size: int, content: int) -> MemoryFunctions:
    """Return functions for all elements of a size and with a content to free."""
    return memory_functions(size, content, None)


def memory_functions(size: int, content: int, converter: object) -> MemoryFunctions:
    """Return new functions; they live as long as the process."""
    allocate, deallocate = allocator()
    made = machine_code.functions(
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
    return MemoryFunctions(*(made[name] for name in MemoryFunctions._fields))


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


# A table of words says what must be freed in a structure: how many entries, and for
# each entry an offset, how many elements are there (none: they are in memory of their
# own, as the three words of a sequence or string say), the size of an element, and the
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
