"""The opaque road: rmw_fastrtps_cpp and others that use its type support.

The middleware never looks into message memory here, so it is a `Memory` that holds the
encoded bytes. Encoding comes before the middleware is called, decoding after it: Fast DDS
calls the two functions that copy the bytes while it holds the mutex of a writer or a
reader, and another thread may wait for that mutex while it holds the interpreter's lock.
Whoever gave that lock away in there would never get it back.
"""

from __future__ import annotations

import ctypes
import sys
from _thread import get_ident
from collections.abc import Callable
from ctypes import PYFUNCTYPE, c_bool, c_char, c_char_p, c_size_t, c_void_p, py_object
from functools import cache
from typing import Any

from . import typesupport_c as c
from . import typesupport_callbacks as callbacks
from . import typesupport_introspection as introspection
from .cdr import HEADERS, NATIVE
from .codec import encode_error, functions
from .typesupport_descriptions import about
from .typesupport_fastcdr import fast_cdr

IDENTIFIER = "rosidl_typesupport_fastrtps_c"

#: The encapsulation header, which the middleware reads and writes itself.
_HEADER = 4
#: An array with this many bytes is not copied on its way to the middleware.
_LARGE = 16384


class Memory:
    """Message memory: `message @ memory` encodes into it, `+memory` is the message.

    `__len__` is the encoded size. It is a slot that holds a function, so that no
    bytecode runs where C asks for the size.
    """

    __slots__ = (
        *("body", "first", "head", "length"),
        *("message", "received", "second", "size", "tail"),
    )

    #: The encoded message without header, and its size. Of a large one, the body is only
    #: its largest array, which stands from `first` to `second`, between head and tail.
    body: bytes | memoryview
    size: int
    first: int
    second: int
    head: bytes
    tail: bytes
    length: Callable[[], int]
    #: The message that `body` was made from.
    message: Any
    #: What was received, with header; no attribute in a memory that is sent.
    received: bytes


_memory: Any = Memory
_memory.__len__ = _memory.length


def _memory_type(name: str, cls: Any) -> type[Memory]:
    """Return the memory of a message class, which works with the class's codec."""
    codec = cls._codec_(NATIVE)
    encode, bulk = codec.encode, codec.bulk
    true = c.TRUE
    large = False

    def store(memory: Any, message: Any) -> object:
        nonlocal large
        try:
            parts = encode(message)
            parts[0] = parts[0][_HEADER:]
            if large:
                size = _store_apart(memory, parts)
            else:
                memory.body = body = parts[0] if len(parts) == 1 else b"".join(parts)
                memory.second = size = len(body)
                memory.first, memory.head, memory.tail = 0, b"", b""
            # what follows on a topic is as large as what came before
            large = bulk and size >= _LARGE
        except Exception as error:
            raise encode_error(message, sys.byteorder, error) from error
        memory.size = size
        memory.length = size.__index__
        memory.message = message
        return true

    namespace = {"__slots__": (), "__rmatmul__": store, "__pos__": _taker(name, cls)}
    return type("Memory", (Memory,), namespace)


def _store_apart(memory: Memory, parts: list[Any]) -> int:
    """Put the parts of a message into a memory, the largest uncopied; return their size."""
    views = [memoryview(part).cast("B") for part in parts]
    sizes = list(map(len, views))
    at = sizes.index(max(sizes))
    memory.head, memory.body = b"".join(views[:at]), views[at]
    memory.tail = b"".join(views[at + 1 :])
    memory.first = sum(sizes[:at])
    memory.second = memory.first + sizes[at]
    return sum(sizes)


def _taker(name: str, cls: Any) -> Callable[[Any], Any]:
    """Return the function that gives the message in a memory, or `None` for garbage."""
    decode = cls._codec_(NATIVE).decode
    _, decode_any = functions(cls)
    native = HEADERS[NATIVE][1]

    def taken(memory: Any) -> Any:
        try:
            try:
                data = memory.received
            except AttributeError:
                return memory.message
            if data[1] == native and not data[0]:
                try:
                    return decode(data)
                except Exception:  # noqa: S110 (told exactly by what follows)
                    pass
            return decode_any(data)
        except BaseException as error:
            failure = error
        try:
            if not callbacks.interrupted(failure):
                callbacks.report(f"a received {name} was dropped", failure)
                nothing, thread = callbacks.nothing_taken(name), get_ident()
                return nothing[thread]
        except Exception:
            return None
        except BaseException:  # noqa: S110 (one more interrupt)
            pass
        return taken(memory)

    return callbacks.deaf(taken)


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
def _serializer(bulk: bool) -> int:
    """Return `cdr_serialize(memory, cdr)`, which never lets another thread run.

    The interpreter may do so after a call and where it jumps, so there is neither.
    """
    position, end = fast_cdr()
    everything, words = c.MEMORY, c.WORDS

    def serialize(memory: Any, cdr: int) -> bool:
        try:
            here = cdr >> 3
            start = words[here + position]
            stop = start + memory.size
            if stop <= words[here + end]:
                everything[start:stop] = memory.body
                words[here + position] = stop
                return True
        except BaseException:  # noqa: S110
            pass
        return False

    def serialize_bulk(memory: Any, cdr: int) -> bool:
        try:
            here = cdr >> 3
            start = words[here + position]
            stop = start + memory.size
            if stop <= words[here + end]:
                first, second = start + memory.first, start + memory.second
                everything[start:first] = memory.head
                everything[first:second] = memory.body
                everything[second:stop] = memory.tail
                words[here + position] = stop
                return True
        except BaseException:  # noqa: S110
            pass
        return False

    function = serialize_bulk if bulk else serialize
    return callbacks.callback(PYFUNCTYPE(c_bool, py_object, c_void_p), function)


@cache
def _deserializer() -> int:
    """Return `cdr_deserialize(cdr, memory)`, which never lets another thread run either."""
    position, end = fast_cdr()
    characters, words = c.CHARACTERS, c.WORDS

    def deserialize(cdr: int, memory: Any) -> bool:
        try:
            here = cdr >> 3
            memory.received = characters[
                words[here + position] - _HEADER : words[here + end]
            ]
            return True
        except BaseException:
            return False

    return callbacks.callback(PYFUNCTYPE(c_bool, c_void_p, py_object), deserialize)


@cache
def _unbounded() -> int:
    """Return `max_serialized_size(bounds_info)`, which says that there is no maximum."""

    def maximum(bounds_info: Any) -> int:
        try:  # noqa: SIM105 (a context manager would be called outside of it)
            bounds_info[0] = b"\0"
        except BaseException:  # noqa: S110
            pass
        return 0

    return callbacks.callback(PYFUNCTYPE(c_size_t, ctypes.POINTER(c_char)), maximum)


@cache
def _identifier() -> int:
    library = introspection.load_library(f"lib{IDENTIFIER}.so")
    return c_void_p.in_dll(library, f"{IDENTIFIER}__identifier").value or 0


def message(cls: Any, name: str) -> c.MessageSupport:
    """Return what rclpy needs to publish and take messages of a class."""
    package, kind, short = name.split("/")
    functions = _Callbacks(
        f"{package}::{kind}".encode(),
        short.encode(),
        _serializer(cls._codec_(NATIVE).bulk),
        _deserializer(),
        c.c_function("PyObject_Size"),
        _unbounded(),
    )
    support = c.keep(c.MessageTypeSupport(_identifier(), c.pointer(functions)))
    answers = {
        IDENTIFIER.encode(): ctypes.addressof(support),
        introspection.IDENTIFIER.encode(): introspection.handle(name),
    }
    support.func = c.resolver(answers)
    support.about = about(name)
    return c.MessageSupport(ctypes.addressof(support), _memory_type(name, cls))


def service(name: str, request: int, response: int, event: int) -> tuple[int, int]:  # noqa: ARG001
    """Return identifier and data of a service's type support; handles of its messages given."""
    package, kind, short = name.split("/")
    functions = _ServiceCallbacks(
        f"{package}::{kind}".encode(), short.encode(), request, response
    )
    return _identifier(), c.pointer(functions)
