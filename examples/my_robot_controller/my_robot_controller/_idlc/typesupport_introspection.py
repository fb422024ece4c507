"""Introspection members: field names, types and C offsets, as a middleware walks them.

Both roads need them. Fast DDS describes types to its peers from them and never looks at
the memory; introspection-based middlewares read and write the memory that they
describe.
"""

from __future__ import annotations

import ctypes
from ctypes import PYFUNCTYPE, c_bool, c_char_p, c_size_t, c_uint8, c_uint32, c_void_p
from functools import cache
from typing import Any, NamedTuple

from . import typesupport_c as c
from . import typesupport_callbacks as callbacks
from .typesupport_descriptions import (
    ARRAY,
    BOUNDED_SEQUENCE,
    NESTED,
    SCALAR,
    Field,
    about,
    load,
)

IDENTIFIER = "rosidl_typesupport_introspection_c"

#: Type id in descriptions -> (type id in introspection, C type of one element).
_ELEMENTS: dict[int, tuple[int, Any]] = {
    2: (9, ctypes.c_int8),
    3: (8, ctypes.c_uint8),
    4: (11, ctypes.c_int16),
    5: (10, ctypes.c_uint16),
    6: (13, ctypes.c_int32),
    7: (12, ctypes.c_uint32),
    8: (15, ctypes.c_int64),
    9: (14, ctypes.c_uint64),
    10: (1, ctypes.c_float),
    11: (2, ctypes.c_double),
    15: (6, ctypes.c_bool),
    16: (7, ctypes.c_uint8),
    17: (16, c.String),
    18: (17, c.String),
    21: (16, c.String),
    22: (17, c.String),
}
_MESSAGE = 18


class Member(ctypes.Structure):
    """`rosidl_typesupport_introspection_c__MessageMember`."""

    _fields_ = (
        ("name", c_char_p),
        ("type_id", c_uint8),
        ("string_upper_bound", c_size_t),
        ("members", c_void_p),
        ("is_key", c_bool),
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
    )


class Members(ctypes.Structure):
    """`rosidl_typesupport_introspection_c__MessageMembers`."""

    _fields_ = (
        ("namespace", c_char_p),
        ("name", c_char_p),
        ("count", c_uint32),
        ("size_of", c_size_t),
        ("has_any_key_member", c_bool),
        ("members", c_void_p),
        ("init_function", c_void_p),
        ("fini_function", c_void_p),
    )


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
    introspection = load_library(f"lib{IDENTIFIER}.so")
    runtime = load_library("librosidl_runtime_c.so")
    return Library(
        c_void_p.in_dll(introspection, f"{IDENTIFIER}__identifier").value or 0,
        c.address(runtime.get_message_typesupport_handle_function),
        c.address(runtime.get_service_typesupport_handle_function),
    )


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


@cache
def structure(name: str) -> type[ctypes.Structure]:
    """Return the C structure that rosidl's C generator would make for a message."""
    fields = [(f"f{i}", _c_type(field)) for i, field in enumerate(load().types[name])]
    return type(name.replace("/", "__"), (ctypes.Structure,), {"_fields_": fields})


def element_type(field: Field) -> Any:
    """Return the C type of one element of a field."""
    return (
        structure(field.nested_type_name)
        if field.base == NESTED
        else _ELEMENTS[field.base][1]
    )


def _c_type(field: Field) -> Any:
    if field.shape == SCALAR:
        return element_type(field)
    return element_type(field) * field.capacity if field.shape == ARRAY else c.Sequence


def placed_fields(name: str) -> list[tuple[Field, int]]:
    """Return a message's fields and where each begins in the C structure."""
    kind = structure(name)
    offsets = [getattr(kind, field_name).offset for field_name, *_ in kind._fields_]
    return list(zip(load().types[name], offsets, strict=True))


def _member(field: Field, offset: int) -> Member:
    """Return how a field is told to the middleware.

    No size function: without one, Cyclone DDS reads sequences from C memory by itself.
    """
    type_id, size = _MESSAGE, ctypes.sizeof(element_type(field))
    if field.base != NESTED:
        type_id = _ELEMENTS[field.base][0]
    member = Member(
        name=field.name.encode(),
        type_id=type_id,
        string_upper_bound=field.string_capacity,
        members=handle(field.nested_type_name) if field.nested_type_name else None,
        is_array=field.shape != SCALAR,
        array_size=field.capacity,
        is_upper_bound=field.shape == BOUNDED_SEQUENCE,
        offset=offset,
    )
    if field.base == NESTED and field.shape != SCALAR:
        member.get_function = member.get_const_function = _get(
            field.shape == ARRAY, size
        )
        if field.shape != ARRAY:
            member.resize_function = _resize(field.nested_type_name, size)
    return member


@cache
def _get(fixed: bool, size: int) -> int:
    """Return `get(field, index)`, the address of an element.

    A result must come out whatever happens, so no function is called in these two: the
    interpreter looks for signals only where functions are called.
    """

    def in_array(field: int, index: int) -> int:
        try:
            return field + index * size
        except BaseException:
            return 0

    def in_sequence(field: Any, index: int) -> int:
        try:
            return field[0].data + index * size  # type: ignore[no-any-return]
        except BaseException:
            return 0

    if fixed:
        return callbacks.callback(PYFUNCTYPE(c_void_p, c_size_t, c_size_t), in_array)
    prototype = PYFUNCTYPE(c_void_p, ctypes.POINTER(c.Sequence), c_size_t)
    return callbacks.callback(prototype, in_sequence)


@cache
def _resize(name: str, size: int) -> int:
    """Return `resize(field, count)`, which frees what there was and makes `count` elements."""
    from . import typesupport_transcode as transcode

    many = transcode.Many(list(transcode.steps(name)), 0, size)

    def resize(field: int, count: int) -> bool:
        try:
            many.free(field)
            if count:
                transcode.allocate(field, count, size, zero=True)
            return True
        except BaseException as error:
            failure = error
        try:
            if callbacks.interrupted(failure):
                return resize(field, count)
            callbacks.report("a received message was dropped", failure)
        except BaseException:  # noqa: S110
            pass
        return False

    return callbacks.callback(PYFUNCTYPE(c_bool, c_void_p, c_size_t), resize)


def members(name: str, shift: int = 0) -> Members:
    """Return a message's members; `shift`: bytes before the structure in message memory."""
    placed = placed_fields(name)
    table = [_member(field, offset + shift) for field, offset in placed]
    package, kind, short = name.split("/")
    return c.keep(
        Members(
            namespace=f"{package}__{kind}".encode(),
            name=short.encode(),
            count=len(table),
            size_of=ctypes.sizeof(structure(name)) + shift,
            members=c.sequence(table, Member).data,
        )
    )


@cache
def handle(name: str, shift: int = 0) -> int:
    """Return the address of a message's introspection type support."""
    support = c.MessageTypeSupport(
        library().identifier,
        ctypes.addressof(members(name, shift)),
        library().same_handle,
        about(name),
    )
    return c.pointer(support)
