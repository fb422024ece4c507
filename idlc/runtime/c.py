"""The C side of type support: structures, capsules, and functions that C calls.

Everything given to C must live as long as the process, so it goes through `keep`.

An exception that leaves a ctypes callback leaves the result *uninitialised*. So functions whose
result is a pointer are built from C callables only (`constant`, `resolver`): no bytecode runs in
them, hence no signal handler either. `callback` takes Python that catches everything.

A thread that runs Python may have to let another one run, whatever its C callers hold: a
middleware calls type support while it has locks of its own, and from any thread. Whoever waits
there for the interpreter's lock, or gives it away, can wait for ever for a thread that wants such
a lock. So these functions are machine code: a few hundred bytes that are the same for all types,
and words that differ from type to type.
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
from base64 import b64decode
from collections.abc import Callable
from ctypes import c_char_p, c_int, c_size_t, c_uint8, c_uint64, c_void_p, py_object
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


def structure(name: str, pointers: str = "", /, **fields: Any) -> Any:
    """Return a C structure of some pointers, by their names, and of fields that follow them."""
    types = dict.fromkeys(pointers.split(), c_void_p) | fields
    return type(name, (ctypes.Structure,), {"_fields_": tuple(types.items())})


_SIZES = {"size": c_size_t, "capacity": c_size_t}
#: `rosidl_runtime_c__String` and its twin in type descriptions; `size` without the NUL.
String = structure("String", data=c_char_p, **_SIZES)
#: Any `X__Sequence`; `data` points to `size` elements.
Sequence = structure("Sequence", "data", **_SIZES)
#: A sequence of numbers or strings since ROS 2 Lyrical; flags of zero mean as before.
FlaggedSequence = structure("FlaggedSequence", "data", **_SIZES, flags=c_uint64)

# `rosidl_runtime_c__type_description__FieldType`, and so on
FieldType = structure(
    "FieldType",
    type_id=c_uint8,
    capacity=c_uint64,
    string_capacity=c_uint64,
    nested_type_name=String,
)
Field = structure("Field", name=String, type=FieldType, default_value=String)
IndividualDescription = structure("Individual", type_name=String, fields=Sequence)
Description = structure(
    "Description", type_description=IndividualDescription, referenced=Sequence
)
Source = structure(
    "Source", type_name=String, encoding=String, raw_file_contents=String
)

#: `rosidl_type_hash_t`; version 1 is RIHS01.
TypeHash = structure("TypeHash", version=c_uint8, value=c_uint8 * 32)
#: The three functions by which rcl asks for hash, description and sources: never NULL.
About = structure("About", "type_hash description sources")

# `rosidl_message_type_support_t`, and so on
MessageTypeSupport = structure("Message", "identifier data func", about=About)
ServiceTypeSupport = structure(
    "Service",
    "identifier data func request response event event_create event_destroy",
    about=About,
)
ActionTypeSupport = structure(
    "Action",
    "goal_service result_service cancel_service feedback_message status_message",
    about=About,
)
#: `rosidl_service_introspection_info_t`.
EventInfo = structure(
    "EventInfo",
    event_type=c_uint8,
    sec=ctypes.c_int32,
    nanosec=ctypes.c_uint32,
    client_gid=c_uint8 * 16,
    sequence_number=ctypes.c_int64,
)


def string(text: str) -> Any:
    """Return `text` as a C string with a size; its bytes live as long as the structure."""
    data = text.encode()
    return String(data, len(data), len(data) + 1)


def sequence(items: list[Any], element: Any) -> Any:
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
CHARACTERS = (ctypes.c_char * (1 << 62)).from_address(0)
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
#: Their code by processor, in base 64, with spaces between them. A test assembles the text
#: that is named and compares.
CODE = {
    ("fastrtps", "x86_64"): (  # machine_code_fastrtps_x86_64.s
        "8w8e+lNVQVRBVUiD7BgxwEiLHdEBAABIixwfSIXbdGRIAx3RAQAATIsrSIPDCEiLLaMBAABIAfVM"
        "i2UASIsVnQEAAEiLFBZMKeJMOepyKk2F7XQcTInnSIszSItTCEkB1Ekp1f8VTgEAAEiDwxDr30yJ"
        "ZQC4AQAAAEiDxBhBXUFcXVvDSIsVdQEAAEiLFBdIhdJ05UiLHW0BAABMiywaSYPtBEgDFU4BAABI"
        "g8IESIkUJEyJbCQISInj6W////+Q 8w8e+lNIifNIiwUJAQAASIsEB0iD6ARIizUCAQAASIs0N0g"
        "pxkiJx/8V0gAAAEiFwHQaSAMd9gAAAEiLO0iJA/8VwgAAALgBAAAAW8P/Fb0AAAAxwFvDkA== 8w"
        "8e+kiLBcUAAABIiwQHSIXAdAtIAwXFAAAASIsAw0iLBcIAAABIiwQHSIXAdA9IixW6AAAASIsEEE"
        "iD6ATDkA== 8w8e+sYHADHAw2YPH0QAAA== 8w8e+kiLFZ0AAABIiwJIhcB0IUiJ8USKAEQ6AXUQ"
        "SP/ASP/BRYTAde1Ii0IIw0iDwhDr18MPHwA= 8w8e+kiLPW0AAAD/JW8AAAAPH4AAAAAA"
    ),
    ("fastrtps", "aarch64"): (  # machine_code_fastrtps_aarch64.s
        "XyQD1f17vKnzUwGp9VsCqf0DAJFzDwBYE2hz+HMDALSCDwBYcwICi3aGQPgAAIBSFA4AWJQCAYuV"
        "AkD54g0AWCJoYvhCABXLXwAW62MBAFQWAQC04AMVqmEKwai1AgKL1gICy3ALAFgAAj/W+f//F5UC"
        "APkgAIBS81NBqfVbQqn9e8SowANf1oIMAFgCaGL4AACAUiL//7RDDABYVmhj+NYSANFjCwBYQgAD"
        "i0IQAJHzwwCRYloAqd3//xcfIAPV XyQD1f17vqnzCwD5/QMAkfMDAariCABYAmhi+EIQANHBCAB"
        "YAWhh+CEAAsvgAwKqUAcAWAACP9ZAAQC0YggAWHMCAothAkD5YAIA+eADAaqQBgBYAAI/1iAAgFI"
        "EAAAUUAYAWAACP9YAAIBS8wtA+f17wqjAA1/W XyQD1SEGAFgBaGH4gQAAtEAGAFggaGD4wANf1i"
        "EGAFgAaGH4gAAAtAEGAFgAaGH4ABAA0cADX9Y= XyQD1R8AADkAAIDSwANf1g== XyQD1SIFAFhD"
        "AED5YwEAtOQDAaplFEA4hhRAOL8ABmuBAABUhf//NUAEQPnAA1/WQkAAkfX//xcAAIDSwANf1g=="
        " XyQD1WADAFiQAwBYAAIf1g=="
    ),
    ("structs", "x86_64"): (  # machine_code_structs_x86_64.s
        "U1VBVEFVQVZBV0iD7AhJifxIix5IjW4ISIXbdGZMi20ATQHlTYnvTIt1CE2F9nUITYt9AE2LdRBI"
        "g30YAHQaTYX2dBVMif9Ii3UY6LD///9MA30QSf/O6+ZIg30IAHUaSYt9ADH2/xVsAQAAMcBJiUUA"
        "SYlFCEmJRRBIg8UgSP/L65VIg8QIQV9BXkFdQVxdW8NmDx9EAAA= 8w8e+r8BAAAASIs1YAEAADH"
        "S/yUgAQAA 8w8e+lNIiftIizU5AQAA6Dz///9Iid9bMfb/JQgBAAA= 8w8e+lNVSIPsCEiJ+0iJ9"
        "UiJ90iLNQ4BAADoEf///0iLPfoAAABIie5Iidr/Fd4AAACFwA+UwEiDxAhdW8NmkA== 8w8e+kiJ"
        "/kiLPdIAAAD/JcQAAAAPH0AA 8w8e+kiLNcUAAADpyP7//w== 8w8e+lNVSIPsCEiJ+0iJ9UiLNb"
        "EAAADorP7//7gBAAAASIXtdCdIie9IizWgAAAAMdL/FWAAAABIhcB0EEiJA0iJawhIiWsQuAEAAA"
        "BIg8QIXVvDDx9AAA== 8w8e+kiLRwjDDx+AAAAAAA== 8w8e+kiLBV0AAABID6/GSAMHww8fRAAA"
        " 8w8e+kiLBUUAAABID6/GSAH4ww8fRAAA"
    ),
    ("structs", "aarch64"): (  # machine_code_structs_aarch64.s
        "/Xu8qfNTAan1WwKp92MDqf0DAJHzAwCqNIRA+PUDAaq0AwC0tgJA+dYCE4v3AxaquAZA+XgAALXX"
        "AkD52ApA+aEOQPkhAQC0GAEAtOADF6qhDkD56///l6AKQPn3AgCLGAcA0fn//xegBkD54AAAtcAC"
        "QPkBAIDSkAsAWAACP9bffgCp3woA+bWCAJGUBgDR5P//F/NTQan1W0Kp92NDqf17xKjAA1/W XyQ"
        "D1SAAgNJBCwBYAgCA0lAJAFgAAh/W XyQD1f17vqn9AwCR4AsA+cEJAFjL//+X4AtA+f17wqgBAI"
        "DSMAgAWAACH9YfIAPV XyQD1f17vqn9AwCR4AcBqeADAaohCABYvv//l+IHQamABwBY8AYAWAACP"
        "9YfAABx4BefGv17wqjAA1/WHyAD1Q== XyQD1eEDAKpABgBY8AUAWAACH9YfIAPV XyQD1eEFAFi"
        "s//8XHyAD1Q== XyQD1f17vqn9AwCR4AcBqUEFAFil//+X4A9A+SABALQBBQBYAgCA0hADAFgAAj"
        "/WoAAAtOELQakgCACpIggA+SAAgFL9e8KowANf1h8gA9U= XyQD1QAEQPnAA1/WHyAD1Q== XyQD"
        "1eICAFgAAED5IAACm8ADX9YfIAPV XyQD1SICAFggAAKbwANf1g=="
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
    parts = [b64decode(code) for code in CODE[kind, machine].split()]
    offsets = accumulate(map(len, parts), initial=0)
    names = FUNCTIONS[kind].split()
    return b"".join(parts), dict(zip(names, offsets, strict=False))


def _executable(code: bytes) -> int:
    """Return where `code` can be executed: a file in memory, never writable where it is.

    That is allowed on more systems than to make memory executable that was written to.
    """
    library = ctypes.CDLL(None, use_errno=True)
    library.mmap.restype = ctypes.c_ssize_t
    library.mmap.argtypes = (c_void_p, c_size_t, c_int, c_int, c_int, ctypes.c_ssize_t)
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
