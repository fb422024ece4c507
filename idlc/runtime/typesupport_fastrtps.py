"""The opaque road: rmw_fastrtps_cpp and others that use its type support.

The middleware never looks into message memory here, so it is a `Memory`: the codec's bytes on the
way out, the decoded object on the way in. Convert and destroy are functions of Python's own C
interface, hence an exception reaches the caller of `publish` untouched.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import PYFUNCTYPE, c_bool, c_char, c_char_p, c_size_t, c_void_p, py_object
from functools import cache
from typing import Any

from . import typesupport_c as c
from . import typesupport_introspection as introspection
from .typesupport_descriptions import about
from .typesupport_fastcdr import fast_cdr

IDENTIFIER = "rosidl_typesupport_fastrtps_c"

_HEADER_SIZE = 4
#: How many `Cdr` objects are remembered; they live on the stack, at few different addresses.
_MAX_VIEWS = 256
_views: dict[int, memoryview] = {}


class Memory:
    """Message memory: `message @ memory` encodes into it, `+memory` is the decoded message.

    `__len__` is the encoded size. It is a slot that holds a function, so that no bytecode runs
    where C asks for the size: an interrupt there could not be told.
    """

    __slots__ = ("length", "message", "parts")

    def __rmatmul__(self, message: Any) -> int:  # noqa: ANN401
        """Encode `message`; raise what the codec raises."""
        parts = self.parts = message._parts()
        self.length = sum(map(len, parts)).__index__
        self.message = message
        return c.TRUE

    def __pos__(self) -> object:
        """Return the message that was decoded last."""
        return self.message


Memory.__len__ = Memory.length


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


def _address_of(part: Any) -> int:  # noqa: ANN401
    """Return where the bytes of a writable buffer are."""
    return ctypes.addressof(c_char.from_buffer(part))


@cache
def _serializer() -> int:
    """Return `cdr_serialize(memory, cdr)`."""
    position, end, append = fast_cdr()
    views = _views

    def serialize(memory: Memory, cdr: int) -> bool:
        try:
            words = views.get(cdr) or _view(cdr)
            if words[end] - words[position] < memory.length():
                return False
            for part in memory.parts:
                append(cdr, part if type(part) is bytes else _address_of(part), len(part))
        except BaseException as error:  # noqa: BLE001 (nothing may pass through C)
            c.report("a message was not sent", error)
            return False
        return True

    return c.callback(PYFUNCTYPE(c_bool, py_object, c_void_p), serialize)


def _deserializer(name: str, decode: Callable[[memoryview], object]) -> int:
    """Return `cdr_deserialize(cdr, memory)` for one class."""
    position, end, _ = fast_cdr()
    views = _views

    def deserialize(cdr: int, memory: Memory) -> bool:
        try:
            words = views.get(cdr) or _view(cdr)
            start = words[position] - _HEADER_SIZE
            memory.message = decode(c.view_memory(start, words[end] - start, c.READ))
        except BaseException as error:  # noqa: BLE001
            c.report(f"a received {name} was dropped", error)
            return False
        return True

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


def message(cls: type[Any], name: str) -> c.MessageCapsules:
    """Return what rclpy needs to publish and take messages of a class."""
    package, kind, short = name.split("/")
    callbacks = _Callbacks(
        f"{package}::{kind}".encode(),
        short.encode(),
        _serializer(),
        _deserializer(name, cls._decode),
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
    return c.MessageCapsules(
        type_support=c.capsule(ctypes.addressof(support)),
        create=_create(),
        destroy=c.capsule(c.c_function("Py_DecRef")),
        convert_from_py=c.capsule(c.c_function("PyNumber_MatrixMultiply")),
        convert_to_py=c.capsule(c.c_function("PyNumber_Positive")),
    )


@cache
def _create() -> object:
    return c.capsule(c.address(PYFUNCTYPE(py_object)(Memory)))


def new_memory(cls: type[Any]) -> Memory:  # noqa: ARG001 (the other road needs the class)
    """Return empty memory for a message of a class."""
    return Memory()


def service(name: str, request: int, response: int, event: int) -> tuple[int, int]:  # noqa: ARG001
    """Return identifier and data of a service's type support; handles of its messages given."""
    package, kind, short = name.split("/")
    callbacks = _ServiceCallbacks(f"{package}::{kind}".encode(), short.encode(), request, response)
    return _identifier(), c.pointer(callbacks)
