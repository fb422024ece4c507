"""The introspection kind: rmw_cyclonedds_cpp and others that walk over C structures.

Message memory is what rosidl's is: the C structure, and what it refers to, all from
rosidl's allocator. So it does not matter whose type support a middleware works with where
it takes two of one type name for the same, idlc's or rosidl's.
"""

from __future__ import annotations

import ctypes
import sys
from typing import Any

from ..cdr import HEADERS, NATIVE
from ..codec import encode_error, functions
from . import c, callbacks, introspection, memory, transcode
from . import machine_code as native
from .c_layout import structure

_HEADER = 4


def _converter(cls: Any, name: str) -> object:
    """Return an object that keeps messages at addresses: `[address] = message`, `[address]`."""
    encode = cls._codec_(NATIVE).encode
    _, decode = functions(cls)
    everything = transcode.whole(name)

    def store(address: int, message: Any) -> None:
        try:
            data = encode(message, b"".join)
        except Exception as error:
            raise encode_error(message, sys.byteorder, error) from error
        everything.fill(transcode.Cursor(memoryview(data)[_HEADER:]), address)

    def fetch(address: int) -> Any:
        data = bytearray(HEADERS[NATIVE])
        everything.drain(address, data)
        return decode(data)

    methods = {
        "__setitem__": staticmethod(store),
        "__getitem__": staticmethod(callbacks.taking(name, fetch)),
    }
    return type("Converter", (), methods)()


def message(cls: Any, name: str) -> c.MessageSupport:
    """Return what rclpy needs to publish and take messages of a class."""
    size, content = ctypes.sizeof(structure(name)), memory.content(name)
    try:
        made = memory.functions(size, content, _converter(cls, name))
        handle = introspection.handle(name, functional=True)
    except native.RefusedError as error:
        raise ImportError(
            f"idlc's type support for this middleware needs machine code, but {error}: "
            "set RMW_IMPLEMENTATION to rmw_fastrtps_cpp, or build the interface package "
            "with colcon"
        ) from error
    return c.MessageSupport(handle, *made[:4])


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
