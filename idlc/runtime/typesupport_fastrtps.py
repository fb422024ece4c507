"""The opaque road: rmw_fastrtps_cpp and others that use its type support.

The middleware never looks into message memory here, so it is a `Memory`: the codec's bytes on the
way out, the decoded object on the way in. Convert and destroy are functions of Python's own C
interface, hence an exception reaches the caller of `publish` untouched.
"""

from __future__ import annotations

import ctypes
import sys
from ctypes import PYFUNCTYPE, c_bool, c_char, c_char_p, c_size_t, c_void_p, py_object
from functools import cache
from typing import Any

from . import typesupport_c as c
from . import typesupport_introspection as introspection
from .cdr import NATIVE
from .codec import encode_error, install
from .typesupport_descriptions import about
from .typesupport_fastcdr import fast_cdr

IDENTIFIER = "rosidl_typesupport_fastrtps_c"

#: The encapsulation header, which the middleware reads and writes itself.
_HEADER = 4
#: Received messages up to this size are copied into `bytes`, which decode faster than views.
_SMALL = 4096
#: How many `Cdr` objects are remembered; they live on the stack, at few different addresses.
_MAX_VIEWS = 256
_views: dict[int, memoryview] = {}


class Memory:
    """Message memory: `message @ memory` encodes into it, `+memory` is the message itself.

    `__len__` is the encoded size. It is a slot that holds a function, so that no bytecode runs
    where C asks for the size: an interrupt there could not be told.
    """

    __slots__ = ("length", "message", "parts")

    def __pos__(self) -> Any:  # noqa: ANN401
        """Return the message that was encoded or decoded last."""
        return self.message


Memory.__len__ = Memory.length  # type: ignore[attr-defined]


def _buffers(parts: list[Any]) -> list[Any]:
    """Return the parts after the first as writable views of bytes, which have addresses."""
    views = [memoryview(part) for part in parts[1:]]
    bytewise = [view.cast("B") for view in views if view.nbytes]
    return [memoryview(bytearray(view)) if view.readonly else view for view in bytewise]


def _memory_type(cls: Any) -> type[Memory]:  # noqa: ANN401
    """Return the memory of a message class, which encodes with the class's codec."""
    encode = cls._codec_(NATIVE).encode
    true = c.TRUE

    def store(memory: Any, message: Any) -> object:  # noqa: ANN401
        try:
            parts = encode(message)
        except Exception as error:
            raise encode_error(message, sys.byteorder, error) from error
        size = len(parts[0]) - _HEADER
        if len(parts) > 1:
            parts[1:] = _buffers(parts)
            size += sum([part.nbytes for part in parts[1:]])
        memory.parts = parts
        memory.length = size.__index__
        memory.message = message
        return true

    return type("Memory", (Memory,), {"__slots__": (), "__rmatmul__": store})


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
    words = (c_size_t * 64).from_address(cdr)
    view = _views[cdr] = memoryview(words).cast("B").cast("N")
    return view


@cache
def _serializer() -> int:
    """Return `cdr_serialize(memory, cdr)`."""
    position, end, append = fast_cdr()
    views = _views
    body = c.BYTES_OFFSET + _HEADER

    def serialize(memory: Any, cdr: int) -> bool:  # noqa: ANN401
        try:
            words = start = None
            words = views.get(cdr) or _view(cdr)
            start = words[position]
            if words[end] - start < memory.length():
                return False
            parts = memory.parts
            append(cdr, id(parts[0]) + body, len(parts[0]) - _HEADER)
            if len(parts) > 1:
                for part in parts[1:]:
                    append(cdr, ctypes.addressof(c_char.from_buffer(part)), len(part))
            return True
        except BaseException as error:  # noqa: BLE001 (nothing may pass through C)
            failure = error
        try:
            if c.interrupted(failure):
                if start is not None:
                    words[position] = start
                return serialize(memory, cdr)
            c.report("a message was not sent", failure)
        except BaseException:  # noqa: BLE001, S110
            pass
        return False

    return c.callback(PYFUNCTYPE(c_bool, py_object, c_void_p), serialize)


def _deserializer(name: str, cls: Any) -> int:  # noqa: ANN401
    """Return `cdr_deserialize(cdr, memory)` for one class."""
    position, end, _ = fast_cdr()
    views = _views
    install(cls)
    decode = cls.deserialize

    def deserialize(cdr: int, memory: Any) -> bool:  # noqa: ANN401
        try:
            words = views.get(cdr) or _view(cdr)
            start = words[position] - _HEADER
            size = words[end] - start
            if size <= _SMALL:
                memory.message = decode(c.copy_memory(start, size))
            else:
                memory.message = decode(c.view_memory(start, size, c.READ))
            return True
        except BaseException as error:  # noqa: BLE001
            failure = error
        try:
            if c.interrupted(failure):
                return deserialize(cdr, memory)
            c.report(f"a received {name} was dropped", failure)
        except BaseException:  # noqa: BLE001, S110
            pass
        return False

    return c.callback(PYFUNCTYPE(c_bool, c_void_p, py_object), deserialize)


@cache
def _unbounded() -> int:
    """Return `max_serialized_size(bounds_info)`, which says that there is no maximum."""

    def maximum(bounds_info: Any) -> int:  # noqa: ANN401
        bounds_info[0] = b"\0"
        return 0

    return c.callback(PYFUNCTYPE(c_size_t, ctypes.POINTER(c_char)), maximum)


@cache
def _identifier() -> int:
    library = introspection.load_library(f"lib{IDENTIFIER}.so")
    return c_void_p.in_dll(library, f"{IDENTIFIER}__identifier").value or 0


def message(cls: Any, name: str) -> c.MessageSupport:  # noqa: ANN401
    """Return what rclpy needs to publish and take messages of a class."""
    package, kind, short = name.split("/")
    callbacks = _Callbacks(
        f"{package}::{kind}".encode(),
        short.encode(),
        _serializer(),
        _deserializer(name, cls),
        c.c_function("PyObject_Size"),
        _unbounded(),
    )
    support = c.keep(c.MessageTypeSupport(_identifier(), c.pointer(callbacks)))
    answers = {
        IDENTIFIER.encode(): ctypes.addressof(support),
        introspection.IDENTIFIER.encode(): introspection.handle(name),
    }
    support.func = c.resolver(answers)
    support.about = about(name)
    return c.MessageSupport(ctypes.addressof(support), _memory_type(cls))


def service(name: str, request: int, response: int, event: int) -> tuple[int, int]:  # noqa: ARG001
    """Return identifier and data of a service's type support; handles of its messages given."""
    package, kind, short = name.split("/")
    callbacks = _ServiceCallbacks(
        f"{package}::{kind}".encode(), short.encode(), request, response
    )
    return _identifier(), c.pointer(callbacks)
