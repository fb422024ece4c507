"""The opaque road: rmw_fastrtps_cpp and others that use its type support.

The middleware never looks into message memory here, so it is a `Memory`: the codec's
bytes on the way out, the decoded object on the way in. Convert and destroy are
functions of Python's own C interface, hence an exception reaches the caller of
`publish` untouched.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from ctypes import PYFUNCTYPE, c_bool, c_char, c_char_p, c_size_t, c_void_p, py_object
from functools import cache
from typing import Any

from . import typesupport_c as c
from . import typesupport_introspection as introspection
from .cdr import HEADERS, NATIVE
from .codec import encode_error, install
from .typesupport_descriptions import about
from .typesupport_fastcdr import fast_cdr

IDENTIFIER = "rosidl_typesupport_fastrtps_c"

#: The encapsulation header, which the middleware reads and writes itself.
_HEADER = 4
#: Received messages up to this size are copied into `bytes`, which decode faster than
#: views.
_SMALL = 4096
#: Arrays with this many elements are not copied on their way to the middleware.
_LARGE = 16384


class Memory:
    """Message memory: `message @ memory` encodes into it, `+memory` is the message.

    `__len__` is the encoded size. It is a slot that holds a function, so that no
    bytecode runs where C asks for the size: an interrupt there could not be told.
    """

    __slots__ = ("body", "length", "message", "parts")

    #: The encoded message without header; large ones are in several parts instead.
    body: bytes | None
    parts: list[memoryview]
    length: Callable[[], int]
    message: Any

    def __pos__(self) -> Any:
        """Return the message that was encoded or decoded last."""
        return self.message


_memory: Any = Memory
_memory.__len__ = _memory.length


def _joined(parts: list[Any]) -> list[memoryview]:
    """Return few parts: large arrays as they are, what lies between them joined."""
    joined = []
    small: list[Any] = []
    for part in parts:
        if len(part) < _LARGE:
            small.append(part)
        else:
            joined += [memoryview(b"".join(small)), memoryview(part).cast("B")]
            small = []
    return [*joined, memoryview(b"".join(small))]


def _memory_type(cls: Any) -> type[Memory]:
    """Return the memory of a message class, which encodes with the class's codec."""
    encode = cls._codec_(NATIVE).encode
    true = c.TRUE

    def store(memory: Any, message: Any) -> object:
        try:
            parts = encode(message)
            body = parts[0][_HEADER:]
            if len(parts) > 1:
                parts[0] = body
                if sum(map(len, parts)) < _LARGE:
                    body = b"".join(parts)
                else:
                    body = None
                    memory.parts = parts = _joined(parts)
        except Exception as error:
            raise encode_error(message, sys.byteorder, error) from error
        memory.body = body
        size = sum(map(len, parts)) if body is None else len(body)
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


@cache
def _serializer() -> int:
    """Return `cdr_serialize(memory, cdr)`."""
    position, end = fast_cdr()
    everything, words = c.MEMORY, c.WORDS

    def serialize(memory: Any, cdr: int) -> bool:
        try:
            here = cdr >> 3
            start = words[here + position]
            body = memory.body
            stop = start + (memory.length() if body is None else len(body))
            if words[here + end] < stop:
                return False
            if body is not None:
                everything[start:stop] = body
            else:
                for part in memory.parts:
                    everything[start : start + len(part)] = part
                    start += len(part)
            words[here + position] = stop
            return True
        except BaseException as error:
            failure = error
        try:
            if c.interrupted(failure):
                return serialize(memory, cdr)
            c.report("a message was not sent", failure)
        except BaseException:  # noqa: S110
            pass
        return False

    return c.callback(PYFUNCTYPE(c_bool, py_object, c_void_p), serialize)


def _deserializer(name: str, cls: Any) -> int:
    """Return `cdr_deserialize(cdr, memory)` for one class."""
    position, end = fast_cdr()
    everything, words = c.MEMORY, c.WORDS
    install(cls)
    decode, bulk = cls._codec_(NATIVE).decode, cls._codec_(NATIVE).bulk
    decode_any = cls.deserialize
    native = HEADERS[NATIVE][1]

    def deserialize(cdr: int, memory: Any) -> bool:
        try:
            here = cdr >> 3
            view = everything[words[here + position] - _HEADER : words[here + end]]
            if bulk and len(view) > _SMALL:
                memory.message = decode_any(view)
                return True
            data = view.tobytes()
            if data[1] == native and not data[0]:
                try:
                    memory.message = decode(data)
                    return True
                except Exception:  # noqa: S110 (told exactly by what follows)
                    pass
            memory.message = decode_any(data)
            return True
        except BaseException as error:
            failure = error
        try:
            if c.interrupted(failure):
                return deserialize(cdr, memory)
            c.report(f"a received {name} was dropped", failure)
        except BaseException:  # noqa: S110
            pass
        return False

    return c.callback(PYFUNCTYPE(c_bool, c_void_p, py_object), deserialize)


@cache
def _unbounded() -> int:
    """Return `max_serialized_size(bounds_info)`, which says that there is no maximum."""

    def maximum(bounds_info: Any) -> int:
        try:  # noqa: SIM105 (a context manager would be called outside of it)
            bounds_info[0] = b"\0"
        except BaseException:  # noqa: S110
            pass
        return 0

    return c.callback(PYFUNCTYPE(c_size_t, ctypes.POINTER(c_char)), maximum)


@cache
def _identifier() -> int:
    library = introspection.load_library(f"lib{IDENTIFIER}.so")
    return c_void_p.in_dll(library, f"{IDENTIFIER}__identifier").value or 0


def message(cls: Any, name: str) -> c.MessageSupport:
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
