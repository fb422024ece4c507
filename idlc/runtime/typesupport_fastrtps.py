"""The opaque road: rmw_fastrtps_cpp and others that use its type support.

The middleware never looks into message memory here, so "memory" is a Python dict: the codec's
bytes on the way out, the decoded object on the way in. Create, destroy and convert are functions
of Python's own C interface, hence an exception reaches the caller of `publish` untouched.
"""

from __future__ import annotations

import ctypes
import logging
import operator
from collections.abc import Callable
from ctypes import PYFUNCTYPE, c_bool, c_char, c_char_p, c_uint32, c_void_p, py_object
from functools import cache
from typing import Any

from . import typesupport_c as c
from . import typesupport_introspection as introspection
from .typesupport_descriptions import about
from .typesupport_fastcdr import fast_cdr

#: Keys of message memory.
MESSAGE, SIZE, PARTS = range(3)
Memory = dict[int, Any]

_HEADER_SIZE = 4
_READ = 0x100
#: How many `Cdr` objects are remembered; they live on the stack, at few different addresses.
_MAX_VIEWS = 256
_views: dict[int, memoryview] = {}


class _Callbacks(ctypes.Structure):
    """`message_type_support_callbacks_t`."""

    _fields_ = (
        ("namespace", c_char_p),
        ("name", c_char_p),
        ("cdr_serialize", c_void_p),
        ("cdr_deserialize", c_void_p),
        ("get_serialized_size", c_void_p),
        ("max_serialized_size", c_void_p),
        ("key_callbacks", c_void_p),
    )


class _ServiceCallbacks(ctypes.Structure):
    """`service_type_support_callbacks_t`."""

    _fields_ = (
        ("namespace", c_char_p),
        ("name", c_char_p),
        ("request", c_void_p),
        ("response", c_void_p),
    )


def _view(cdr: int) -> memoryview:
    """Return the words of a `Cdr`."""
    if len(_views) >= _MAX_VIEWS:
        _views.clear()
    words = (ctypes.c_size_t * 64).from_address(cdr)
    view = _views[cdr] = memoryview(words).cast("B").cast("N")
    return view


def _store(message: Any, memory: Memory) -> int:  # noqa: ANN401
    """Encode a message into its memory; called by rclpy as `message @ memory`."""
    parts = memory[PARTS] = message._parts()
    memory[SIZE] = sum(map(len, parts))
    return c.TRUE


@cache
def _serializer() -> int:
    """Return `cdr_serialize(memory, cdr)`."""
    position, end, append = fast_cdr()
    views = _views

    def serialize(memory: Memory, cdr: int) -> bool:
        try:
            words = views.get(cdr) or _view(cdr)
            if words[end] - words[position] < memory[SIZE]:
                return False
            for part in memory[PARTS]:
                append(cdr, part, len(part))
        except BaseException:
            return False
        return True

    return c.address(PYFUNCTYPE(c_bool, py_object, c_void_p)(serialize))


def _deserializer(decode: Callable[[memoryview], object]) -> int:
    """Return `cdr_deserialize(cdr, memory)` for one class."""
    position, end, _ = fast_cdr()
    views = _views

    def deserialize(cdr: int, memory: Memory) -> bool:
        try:
            words = views.get(cdr) or _view(cdr)
            start = words[position] - _HEADER_SIZE
            memory[MESSAGE] = decode(c.view_memory(start, words[end] - start, _READ))
        except BaseException as error:
            logging.getLogger(__package__).warning("a received message was dropped: %s", error)
            return False
        return True

    return c.address(PYFUNCTYPE(c_bool, c_void_p, py_object)(deserialize))


@cache
def _shared() -> tuple[int, int]:
    """Return `get_serialized_size(memory)` and `max_serialized_size(bounds_info)`."""
    size = PYFUNCTYPE(c_uint32, py_object)(operator.methodcaller("get", SIZE, 0))

    def unbounded(bounds_info: Any) -> int:  # noqa: ANN401
        bounds_info[0] = b"\0"
        return 0

    prototype = PYFUNCTYPE(ctypes.c_size_t, ctypes.POINTER(c_char))
    return c.address(size), c.address(prototype(unbounded))


@cache
def _convert_to_py() -> int:
    fetch = operator.methodcaller("get", MESSAGE)
    return c.address(PYFUNCTYPE(py_object, py_object)(fetch))


_identifiers: dict[str, int] = {}


def _identifier(name: str) -> int:
    library = introspection.load_library(f"lib{name}.so")
    return c_void_p.in_dll(library, f"{name}__identifier").value or 0


def message_support(cls: type, name: str) -> int:
    """Return the address of a class's type support; `cls` learns to encode into its memory."""
    package, kind, short = name.split("/")
    callbacks = _Callbacks(
        f"{package}::{kind}".encode(),
        short.encode(),
        _serializer(),
        _deserializer(cls._decode),
        *_shared(),
    )
    own = c.keep(
        c.MessageTypeSupport(
            _identifier("rosidl_typesupport_fastrtps_c"),
            ctypes.addressof(c.keep(callbacks)),
            introspection.library().same_handle,
            *about(name),
        )
    )
    answers = {
        b"rosidl_typesupport_fastrtps_c": ctypes.addressof(own),
        b"rosidl_typesupport_introspection_c": introspection.handle(name),
    }
    cls.__matmul__ = _store
    support = c.MessageTypeSupport(own.identifier, own.data, c.resolver(answers), *about(name))
    return ctypes.addressof(c.keep(support))


@cache
def capsules() -> dict[str, object]:
    """Return what is the same for all classes."""
    return {
        "_CREATE_ROS_MESSAGE": c.capsule(c.c_function("PyDict_New")),
        "_DESTROY_ROS_MESSAGE": c.capsule(c.c_function("Py_DecRef")),
        "_CONVERT_FROM_PY": c.capsule(c.c_function("PyNumber_MatrixMultiply")),
        "_CONVERT_TO_PY": c.capsule(_convert_to_py()),
    }
