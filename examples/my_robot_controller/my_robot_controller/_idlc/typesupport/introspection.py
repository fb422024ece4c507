"""Introspection members: field names, types and C offsets, as a middleware walks them.

Both kinds of type support need them. Fast DDS describes types to its peers from them
and never looks at the memory; introspection-based middlewares read and write the memory
that they describe, with the functions that stand beside it.
"""

from __future__ import annotations

import ctypes
from ctypes import c_bool, c_char_p, c_size_t, c_uint8, c_uint32, c_void_p
from functools import cache
from typing import Any, NamedTuple

from . import c, memory
from .abi import abi
from .c_layout import element_type, introspection_id, placed_fields, structure
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
    """What is needed of ROS 2's own libraries: addresses."""

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
    """Return how a field is told to the middleware."""
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
        functions = memory.elements(size, memory.element_content(field))
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
    finish = memory.elements(size, memory.content(name)).finish if functional else None
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
