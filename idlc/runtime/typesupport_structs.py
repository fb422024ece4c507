"""The introspection road: rmw_cyclonedds_cpp and others that walk over C structures.

Message memory is a `bytes` object in which the C structure lies. The middleware is
given the object itself, with a member table whose offsets are shifted to where the
content of `bytes` begins. So convert and destroy are functions of Python's own C
interface, as on the other road.
"""

from __future__ import annotations

import ctypes
import sys
from functools import cache, partial
from typing import Any

from . import typesupport_c as c
from . import typesupport_introspection as introspection
from . import typesupport_transcode as transcode
from .cdr import HEADERS, NATIVE
from .codec import encode_error, functions

_HEADER = 4


@cache
def _memory_type(cls: Any, name: str) -> type[bytes]:
    """Return the type of memory for a class: `message @ memory` fills it, `+memory` reads it."""
    encode = cls._codec_(NATIVE).encode
    _, decode = functions(cls)
    everything = transcode.whole(name)
    true = c.TRUE

    def store(memory: bytes, message: Any) -> object:
        try:
            data = b"".join(encode(message))
        except Exception as error:
            raise encode_error(message, sys.byteorder, error) from error
        cursor = transcode.Cursor(memoryview(data)[_HEADER:])
        everything.fill(cursor, id(memory) + c.BYTES_OFFSET)
        return true

    def fetch(memory: bytes) -> object:
        data = bytearray(HEADERS[NATIVE])
        everything.drain(id(memory) + c.BYTES_OFFSET, data)
        return decode(data)

    def free(memory: bytes) -> None:
        everything.free(id(memory) + c.BYTES_OFFSET)

    methods = {"__rmatmul__": store, "__pos__": fetch, "__del__": free}
    return type("Memory", (bytes,), methods)


def message(cls: Any, name: str) -> c.MessageSupport:
    """Return what rclpy needs to publish and take messages of a class."""
    zeros = bytes(ctypes.sizeof(introspection.structure(name)))
    handle = introspection.handle(name, c.BYTES_OFFSET)
    return c.MessageSupport(handle, partial(_memory_type(cls, name), zeros))


class _ServiceMembers(ctypes.Structure):
    """`rosidl_typesupport_introspection_c__ServiceMembers`."""

    _fields_ = (
        ("namespace", ctypes.c_char_p),
        ("name", ctypes.c_char_p),
        ("request", ctypes.c_void_p),
        ("response", ctypes.c_void_p),
        ("event", ctypes.c_void_p),
    )


def service(name: str, *handles: int) -> tuple[int, int]:
    """Return identifier and data of a service's type support; handles of its messages given."""
    package, kind, short = name.split("/")
    members = [
        c.MessageTypeSupport.from_address(handle).data if handle else None
        for handle in handles
    ]
    data = _ServiceMembers(f"{package}__{kind}".encode(), short.encode(), *members)
    return introspection.library().identifier, c.pointer(data)
