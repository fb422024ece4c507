"""The C side of type support: structures, capsules, and functions that C calls.

Everything given to C must live as long as the process, so it goes through `keep`.

An exception that leaves a ctypes callback leaves the result *uninitialised*, and a thread
that runs Python code may have to let another one run, whatever its C callers hold. So there
are three kinds of functions for C. Those whose result is a pointer are built from C callables
only (`constant`, `resolver`): no bytecode runs in them, hence no signal handler either. Those
that `callback` makes are Python that catches everything.

A middleware calls the functions of a type support while it has locks of its own, and from
any thread. Whoever waits there for the interpreter's lock, or gives it away, can wait for
ever for a thread that wants such a lock. So these functions are machine code: a few
hundred bytes that are the same for all types, and words that differ from type to type.
"""

from __future__ import annotations

import _thread
import ctypes
import logging
import opcode
import operator
import os
import struct
import sys
from collections.abc import Callable
from ctypes import (
    c_char,
    c_char_p,
    c_int,
    c_size_t,
    c_ssize_t,
    c_uint8,
    c_uint64,
    c_void_p,
    py_object,
)
from importlib import import_module
from itertools import accumulate, repeat
from types import FunctionType
from typing import Any, NamedTuple, TypeVar

T = TypeVar("T")

_FOREVER: list[object] = []
# The module is torn down before the last C callback may come, so the list outlives its
# name.
ctypes.pythonapi.Py_IncRef(py_object(_FOREVER))


def keep(value: T) -> T:
    """Return `value`, which will never be freed."""
    _FOREVER.append(value)
    return value


class String(ctypes.Structure):
    """`rosidl_runtime_c__String` and its twin in type descriptions; `size` without the NUL."""

    _fields_ = (("data", c_char_p), ("size", c_size_t), ("capacity", c_size_t))


class Sequence(ctypes.Structure):
    """Any `X__Sequence`; `data` points to `size` elements."""

    _fields_ = (("data", c_void_p), ("size", c_size_t), ("capacity", c_size_t))


class FlaggedSequence(ctypes.Structure):
    """A sequence of numbers or strings since ROS 2 Lyrical; flags of zero mean as before."""

    _fields_ = (*Sequence._fields_, ("flags", c_uint64))


class FieldType(ctypes.Structure):
    """`rosidl_runtime_c__type_description__FieldType`."""

    _fields_ = (
        ("type_id", c_uint8),
        ("capacity", c_uint64),
        ("string_capacity", c_uint64),
        ("nested_type_name", String),
    )


class Field(ctypes.Structure):
    """`rosidl_runtime_c__type_description__Field`."""

    _fields_ = (("name", String), ("type", FieldType), ("default_value", String))


class IndividualDescription(ctypes.Structure):
    """`rosidl_runtime_c__type_description__IndividualTypeDescription`."""

    _fields_ = (("type_name", String), ("fields", Sequence))


class Description(ctypes.Structure):
    """`rosidl_runtime_c__type_description__TypeDescription`."""

    _fields_ = (("type_description", IndividualDescription), ("referenced", Sequence))


class Source(ctypes.Structure):
    """`rosidl_runtime_c__type_description__TypeSource`."""

    _fields_ = (
        ("type_name", String),
        ("encoding", String),
        ("raw_file_contents", String),
    )


class TypeHash(ctypes.Structure):
    """`rosidl_type_hash_t`; version 1 is RIHS01."""

    _fields_ = (("version", c_uint8), ("value", c_uint8 * 32))


class About(ctypes.Structure):
    """The three functions by which rcl asks for hash, description and sources: never NULL."""

    _fields_ = (
        ("type_hash", c_void_p),
        ("description", c_void_p),
        ("sources", c_void_p),
    )


class MessageTypeSupport(ctypes.Structure):
    """`rosidl_message_type_support_t`."""

    _fields_ = (
        ("identifier", c_void_p),
        ("data", c_void_p),
        ("func", c_void_p),
        ("about", About),
    )


class ServiceTypeSupport(ctypes.Structure):
    """`rosidl_service_type_support_t`."""

    _fields_ = (
        ("identifier", c_void_p),
        ("data", c_void_p),
        ("func", c_void_p),
        ("request", c_void_p),
        ("response", c_void_p),
        ("event", c_void_p),
        ("event_create", c_void_p),
        ("event_destroy", c_void_p),
        ("about", About),
    )


class ActionTypeSupport(ctypes.Structure):
    """`rosidl_action_type_support_t`."""

    _fields_ = (
        ("goal_service", c_void_p),
        ("result_service", c_void_p),
        ("cancel_service", c_void_p),
        ("feedback_message", c_void_p),
        ("status_message", c_void_p),
        ("about", About),
    )


def string(text: str) -> String:
    """Return `text` as a C string with a size; its bytes live as long as the structure."""
    data = text.encode()
    return String(data, len(data), len(data) + 1)


def sequence(items: list[Any], element: type[ctypes.Structure]) -> Sequence:
    """Return a sequence of copies of `items`, kept for ever."""
    array = keep((element * len(items))(*items))
    return Sequence(ctypes.addressof(array), len(items), len(items))


def pointer(value: ctypes.Structure) -> int:
    """Return the address of a structure that is kept."""
    return ctypes.addressof(keep(value))


def address(function: Any) -> int:
    """Return where the code of a foreign function or callback is; the callback is kept."""
    return ctypes.cast(keep(function), c_void_p).value or 0


def constant(pointer: int) -> int:
    """Return a C function that ignores its arguments and returns `pointer`."""
    return address(ctypes.PYFUNCTYPE(c_void_p)(repeat(pointer).__next__))


def resolver(answers: dict[bytes, int]) -> int:
    """Return the C function `f(handle, identifier)` that gives an answer, else NULL.

    A class attribute that is not a descriptor is called without `self`: the handle
    becomes an object whose `[identifier]` is `answers.get(identifier)`, all of it in C.
    """
    handle = keep(type("Handle", (c_void_p,), {"__getitem__": answers.get}))
    prototype = ctypes.PYFUNCTYPE(c_void_p, handle, c_char_p)
    return address(prototype(operator.getitem))


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


_new_capsule = ctypes.PYFUNCTYPE(py_object, c_void_p, c_char_p, c_void_p)(
    ("PyCapsule_New", ctypes.pythonapi)
)
_capsule_pointer = ctypes.PYFUNCTYPE(c_void_p, py_object, c_char_p)(
    ("PyCapsule_GetPointer", ctypes.pythonapi)
)
if sys.maxsize < 1 << 62:
    raise ImportError("idlc's type support needs a 64-bit Python")

#: All memory of the process, by address, as bytes and as words: `MEMORY[start:stop]`,
#: `WORDS[address >> 3]`. Slicing it is three times faster than calling into C. A slice of
#: CHARACTERS is a copy.
MEMORY = memoryview((c_uint8 * (1 << 62)).from_address(0)).cast("B")
WORDS = MEMORY.cast("Q")
CHARACTERS = (c_char * (1 << 62)).from_address(0)
#: Where the content of a `bytes` object begins, from its `id`; a terminating zero
#: follows it.
BYTES_OFFSET = bytes.__basicsize__ - 1


def capsule(pointer: int) -> object:
    """Return a capsule without a name, as rclpy expects them."""
    return keep(_new_capsule(pointer, None, None))


def capsule_pointer(value: object) -> int:
    """Return what a capsule without a name points to."""
    return int(_capsule_pointer(value, None))


def _c_true() -> object:
    """Return an object that C code takes for `true` where it expects a `bool`.

    A function of Python's C interface that stands in for a `bool` function returns a
    pointer, and the caller looks at its low byte, or (clang, aarch64) at the lowest bit
    only. So the object is put at an address that ends in 01; nothing ever frees it.
    Python 3.14 needs the lowest bit for itself: there the low byte is just not zero,
    which x86-64's gcc accepts.
    """
    if sys.version_info >= (3, 14):
        return next(number for number in range(256) if id(number) & 0xFF)
    room = keep(ctypes.create_string_buffer(0x200))
    start = (ctypes.addressof(room) | 0xFF) + 2
    immortal = 0xFFFF_FFFF if sys.version_info >= (3, 12) else 1 << 60
    MEMORY[start : start + 16] = struct.pack("QQ", immortal, id(object))
    return ctypes.cast(start, py_object).value


#: What `convert_from_py` returns: C reads it as `true` and never releases it.
TRUE = _c_true()


def c_function(name: str) -> int:
    """Return the address of a function of Python's own C interface."""
    return address(getattr(ctypes.pythonapi, name))


class MessageSupport(NamedTuple):
    """The type support of a message class, and the functions of its memory.

    All are addresses.
    """

    handle: int
    create: int
    destroy: int
    convert_from_py: int
    convert_to_py: int


# functions in Python

#: Arguments of the interpreter's RESUME instruction.
_AT_START, _IN_YIELD_FROM = 0, 2


def callback(prototype: Any, function: Callable[..., object]) -> int:
    """Return the C function that calls `function`, a `try` that catches everything."""
    return address(prototype(deaf(function)))


def deaf(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function, which begins with `try`, that no signal interrupts before that.

    Signal handlers run on entry of a Python function, before its first `try`, and what
    they raise would be lost with the result. The interpreter does not look for signals
    where a function resumes inside a `yield from`, so the function is made to look like one.
    (Python 3.10 has no such instruction; it does not look before a leading `try` either.)
    """
    assert isinstance(function, FunctionType)
    code = function.__code__
    raw = bytearray(code.co_code)
    resume = opcode.opmap.get("RESUME")
    at = next((at for at in range(0, len(raw), 2) if raw[at] == resume), None)
    if at is not None and raw[at + 1] == _AT_START:
        raw[at + 1] = _IN_YIELD_FROM
    return FunctionType(
        code.replace(co_code=bytes(raw)),
        function.__globals__,
        function.__name__,
        function.__defaults__,
        function.__closure__,
    )


def interrupted(error: BaseException) -> bool:
    """Return whether a callback should try again because only a signal came in between.

    The signal is sent once more, by another thread: soon, but not before C code is
    left.
    """
    if isinstance(error, Exception):
        return False
    _thread.start_new_thread(_thread.interrupt_main, ())
    return True


def report(what: str, error: BaseException) -> None:
    """Log an error that cannot be raised because C called."""
    logging.getLogger(__package__).warning("%s: %s", what, error)


def taking(name: str, decode: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return a function that gives what `decode` does, and never raises.

    A signal does not cost the message; garbage is reported to rclpy by `_nothing_taken`.
    """

    def taken(memory: Any) -> Any:
        try:
            return decode(memory)
        except BaseException as error:
            failure = error
        try:
            if not interrupted(failure):
                report(f"a received {name} was dropped", failure)
                nothing = _nothing_taken(name, f"{name}: {failure}")
                thread = _thread.get_ident()
                return nothing[thread]
        except Exception:
            return None
        except BaseException:  # noqa: S110 (one more interrupt)
            pass
        return taken(memory)

    return deaf(taken)


def _nothing_taken(name: str, why: str) -> Any:
    """Return an object whose `[thread]` is `None`, and no message of that type to rclpy.

    rclpy accepts that only before a message is decoded. Afterwards an InvalidHandle
    does it, which executors expect from entities that die; it is an RMWError as well,
    which is what `deserialize_message` raises. It is raised in the thread when C code is
    left, and no sooner if no call follows; for actions, `None` is enough.
    """
    package, kind, _ = name.split("/")
    if kind == "action" or package == "action_msgs":
        return type("Nothing", (), {"__getitem__": {}.get})()
    errors = (
        import_module("rclpy.exceptions").InvalidHandle,
        import_module("rclpy._rclpy_pybind11").RMWError,
    )
    raised = type("UndecodableMessage", errors, {"__str__": lambda _: why})
    prototype = ctypes.PYFUNCTYPE(None, ctypes.c_ulong, py_object)
    later = prototype(
        ("PyThreadState_SetAsyncExc", ctypes.pythonapi), ((1,), (1, "", raised))
    )
    return type("Nothing", (), {"__getitem__": later})()


# machine code

_MAP_PRIVATE = 2
_READ_AND_EXECUTE = 1 | 4

#: The functions of each kind of type support, in the order in which they follow each other.
FUNCTIONS = {
    "fastrtps": "serialize deserialize serialized_size maximum_size resolve create",
    "structs": "empty create destroy convert_from_py convert_to_py "
    "finish resize length in_sequence in_array",
}
#: Their code by processor, in hexadecimal, with spaces between them. A test assembles the text
#: that is named and compares.
CODE = {
    ("fastrtps", "x86_64"): (  # machine_code_fastrtps_x86_64.s
        "f30f1efa5355415441554883ec1831c0488b1dd1010000488b1c1f4885db746448031dd10100"
        "004c8b2b4883c308488b2da30100004801f54c8b6500488b159d010000488b14164c29e24c39"
        "ea722a4d85ed741c4c89e7488b33488b53084901d44929d5ff154e0100004883c310ebdf4c89"
        "6500b8010000004883c418415d415c5d5bc3488b1575010000488b14174885d274e5488b1d6d"
        "0100004c8b2c1a4983ed044803154e0100004883c204488914244c896c24084889e3e96fffff"
        "ff90 f30f1efa534889f3488b0509010000488b04074883e804488b3502010000488b3437482"
        "9c64889c7ff15d20000004885c0741a48031df6000000488b3b488903ff15c2000000b801000"
        "0005bc3ff15bd00000031c05bc390 f30f1efa488b05c5000000488b04074885c0740b480305"
        "c5000000488b00c3488b05c2000000488b04074885c0740f488b15ba000000488b04104883e8"
        "04c390 f30f1efac6070031c0c3660f1f440000 f30f1efa488b159d000000488b024885c074"
        "214889f1448a00443a01751048ffc048ffc14584c075ed488b4208c34883c210ebd7c30f1f00"
        " f30f1efa488b3d6d000000ff256f0000000f1f8000000000"
    ),
    ("fastrtps", "aarch64"): (  # machine_code_fastrtps_aarch64.s
        "5f2403d5fd7bbca9f35301a9f55b02a9fd030091730f0058136873f8730300b4820f00587302"
        "028b768640f800008052140e00589402018b950240f9e20d0058226862f8420015cb5f0016eb"
        "63010054160100b4e00315aa610ac1a8b502028bd60202cb700b005800023fd6f9ffff179502"
        "00f920008052f35341a9f55b42a9fd7bc4a8c0035fd6820c0058026862f80000805222ffffb4"
        "430c0058566863f8d61200d1630b00584200038b42100091f3c30091625a00a9ddffff171f20"
        "03d5 5f2403d5fd7bbea9f30b00f9fd030091f30301aae2080058026862f8421000d1c108005"
        "8016861f8210002cbe00302aa5007005800023fd6400100b4620800587302028b610240f9600"
        "200f9e00301aa9006005800023fd620008052040000145006005800023fd600008052f30b40f"
        "9fd7bc2a8c0035fd6 5f2403d521060058016861f8810000b440060058206860f8c0035fd621"
        "060058006861f8800000b401060058006861f8001000d1c0035fd6 5f2403d51f00003900008"
        "0d2c0035fd6 5f2403d522050058430040f9630100b4e40301aa6514403886144038bf00066b"
        "8100005485ffff35400440f9c0035fd642400091f5ffff17000080d2c0035fd6 5f2403d5600"
        "300589003005800021fd6"
    ),
    ("structs", "x86_64"): (  # machine_code_structs_x86_64.s
        "535541544155415641574883ec084989fc488b1e488d6e084885db74664c8b6d004d01e54d89"
        "ef4c8b75084d85f675084d8b7d004d8b751048837d1800741a4d85f674154c89ff488b7518e8"
        "b0ffffff4c037d1049ffceebe648837d0800751a498b7d0031f6ff156c01000031c049894500"
        "49894508498945104883c52048ffcbeb954883c408415f415e415d415c5d5bc3660f1f440000"
        " f30f1efabf01000000488b356001000031d2ff2520010000 f30f1efa534889fb488b353901"
        "0000e83cffffff4889df5b31f6ff2508010000 f30f1efa53554883ec084889fb4889f54889f"
        "7488b350e010000e811ffffff488b3dfa0000004889ee4889daff15de00000085c00f94c0488"
        "3c4085d5bc36690 f30f1efa4889fe488b3dd2000000ff25c40000000f1f4000 f30f1efa488"
        "b35c5000000e9c8feffff f30f1efa53554883ec084889fb4889f5488b35b1000000e8acfeff"
        "ffb8010000004885ed74274889ef488b35a000000031d2ff15600000004885c0741048890348"
        "896b0848896b10b8010000004883c4085d5bc30f1f4000 f30f1efa488b4708c30f1f8000000"
        "000 f30f1efa488b055d000000480fafc6480307c30f1f440000 f30f1efa488b05450000004"
        "80fafc64801f8c30f1f440000"
    ),
    ("structs", "aarch64"): (  # machine_code_structs_aarch64.s
        "fd7bbca9f35301a9f55b02a9f76303a9fd030091f30300aa348440f8f50301aab40300b4b602"
        "40f9d602138bf70316aab80640f9780000b5d70240f9d80a40f9a10e40f9210100b4180100b4"
        "e00317aaa10e40f9ebffff97a00a40f9f702008b180700d1f9ffff17a00640f9e00000b5c002"
        "40f9010080d2900b005800023fd6df7e00a9df0a00f9b5820091940600d1e4ffff17f35341a9"
        "f55b42a9f76343a9fd7bc4a8c0035fd6 5f2403d5200080d2410b0058020080d250090058000"
        "21fd6 5f2403d5fd7bbea9fd030091e00b00f9c1090058cbffff97e00b40f9fd7bc2a8010080"
        "d23008005800021fd61f2003d5 5f2403d5fd7bbea9fd030091e00701a9e00301aa21080058b"
        "effff97e20741a980070058f006005800023fd61f000071e0179f1afd7bc2a8c0035fd61f200"
        "3d5 5f2403d5e10300aa40060058f005005800021fd61f2003d5 5f2403d5e1050058acffff1"
        "71f2003d5 5f2403d5fd7bbea9fd030091e00701a941050058a5ffff97e00f40f9200100b401"
        "050058020080d21003005800023fd6a00000b4e10b41a9200800a9220800f920008052fd7bc2"
        "a8c0035fd61f2003d5 5f2403d5000440f9c0035fd61f2003d5 5f2403d5e2020058000040f9"
        "2000029bc0035fd61f2003d5 5f2403d5220200582000029bc0035fd6"
    ),
}


class RefusedError(Exception):
    """There can be no machine code here: why."""


def machine_code(kind: str, words: dict[str, int]) -> dict[str, int]:
    """Return the addresses of functions by name; they live as long as the process.

    `kind` is that of the type support, `fastrtps` or `structs`. `words` is what their code
    reads, in the order in which it follows the code. Raises RefusedError.
    """
    machine = os.uname().machine
    if (kind, machine) not in CODE:
        raise RefusedError(f"there is none for {machine}")
    code, entries = linked(kind, machine)
    start = _executable(code + struct.pack(f"={len(words)}Q", *words.values()))
    return {name: start + offset for name, offset in entries.items()}


def linked(kind: str, machine: str) -> tuple[bytes, dict[str, int]]:
    """Return all code for a processor, and the offset of each function in it."""
    parts = [bytes.fromhex(code) for code in CODE[kind, machine].split()]
    offsets = accumulate(map(len, parts), initial=0)
    names = FUNCTIONS[kind].split()
    return b"".join(parts), dict(zip(names, offsets, strict=False))


def _executable(code: bytes) -> int:
    """Return where `code` can be executed: a file in memory, never writable where it is.

    That is allowed on more systems than to make memory executable that was written to.
    """
    library = ctypes.CDLL(None, use_errno=True)
    library.mmap.restype = c_ssize_t
    library.mmap.argtypes = (c_void_p, c_size_t, c_int, c_int, c_int, c_ssize_t)
    try:
        file = os.memfd_create("idlc")
    except (AttributeError, OSError) as error:
        raise RefusedError(f"this system does not allow it ({error})") from error
    try:
        os.write(file, code)
        start = library.mmap(None, len(code), _READ_AND_EXECUTE, _MAP_PRIVATE, file, 0)
    finally:
        os.close(file)
    if start == -1:
        reason = os.strerror(ctypes.get_errno())
        raise RefusedError(f"this system does not allow it ({reason})")
    return int(start)
