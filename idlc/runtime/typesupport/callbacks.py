"""Functions that C calls: in Python, and in machine code where no Python may run.

An exception that leaves a ctypes callback leaves the result uninitialised, and a thread
that runs Python code may have to let another one run, whatever its C callers hold.

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
import os
from collections.abc import Callable
from ctypes import c_int, c_size_t, c_ssize_t, c_void_p, py_object
from importlib import import_module
from itertools import accumulate
from struct import pack
from types import FunctionType
from typing import Any

from . import c

#: Arguments of the interpreter's RESUME instruction.
_AT_START, _IN_YIELD_FROM = 0, 2


def callback(prototype: Any, function: Callable[..., object]) -> int:
    """Return the C function that calls `function`, a `try` that catches everything."""
    return c.address(prototype(deaf(function)))


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

#: The functions of each kind of type support and processor, one after the other, in
#: hexadecimal. A test assembles the text that is named and compares.
CODE = {
    ("fastrtps", "x86_64"): {  # machine_code_fastrtps_x86_64.s
        "serialize": (
            "f30f1efa5355415441554883ec1831c0488b1dd1010000488b1c1f48"
            "85db746448031dd10100004c8b2b4883c308488b2da30100004801f5"
            "4c8b6500488b159d010000488b14164c29e24c39ea722a4d85ed741c"
            "4c89e7488b33488b53084901d44929d5ff154e0100004883c310ebdf"
            "4c896500b8010000004883c418415d415c5d5bc3488b157501000048"
            "8b14174885d274e5488b1d6d0100004c8b2c1a4983ed044803154e01"
            "00004883c204488914244c896c24084889e3e96fffffff90"
        ),
        "deserialize": (
            "f30f1efa534889f3488b0509010000488b04074883e804488b350201"
            "0000488b34374829c64889c7ff15d20000004885c0741a48031df600"
            "0000488b3b488903ff15c2000000b8010000005bc3ff15bd00000031"
            "c05bc390"
        ),
        "serialized_size": (
            "f30f1efa488b05c5000000488b04074885c0740b480305c500000048"
            "8b00c3488b05c2000000488b04074885c0740f488b15ba000000488b"
            "04104883e804c390"
        ),
        "maximum_size": "f30f1efac6070031c0c3660f1f440000",
        "resolve": (
            "f30f1efa488b159d000000488b024885c074214889f1448a00443a01"
            "751048ffc048ffc14584c075ed488b4208c34883c210ebd7c30f1f00"
        ),
        "create": "f30f1efa488b3d6d000000ff256f0000000f1f8000000000",
    },
    ("fastrtps", "aarch64"): {  # machine_code_fastrtps_aarch64.s
        "serialize": (
            "5f2403d5fd7bbca9f35301a9f55b02a9fd030091730f0058136873f8"
            "730300b4820f00587302028b768640f800008052140e00589402018b"
            "950240f9e20d0058226862f8420015cb5f0016eb63010054160100b4"
            "e00315aa610ac1a8b502028bd60202cb700b005800023fd6f9ffff17"
            "950200f920008052f35341a9f55b42a9fd7bc4a8c0035fd6820c0058"
            "026862f80000805222ffffb4430c0058566863f8d61200d1630b0058"
            "4200038b42100091f3c30091625a00a9ddffff171f2003d5"
        ),
        "deserialize": (
            "5f2403d5fd7bbea9f30b00f9fd030091f30301aae2080058026862f8"
            "421000d1c1080058016861f8210002cbe00302aa5007005800023fd6"
            "400100b4620800587302028b610240f9600200f9e00301aa90060058"
            "00023fd620008052040000145006005800023fd600008052f30b40f9"
            "fd7bc2a8c0035fd6"
        ),
        "serialized_size": (
            "5f2403d521060058016861f8810000b440060058206860f8c0035fd6"
            "21060058006861f8800000b401060058006861f8001000d1c0035fd6"
        ),
        "maximum_size": "5f2403d51f000039000080d2c0035fd6",
        "resolve": (
            "5f2403d522050058430040f9630100b4e40301aa6514403886144038"
            "bf00066b8100005485ffff35400440f9c0035fd642400091f5ffff17"
            "000080d2c0035fd6"
        ),
        "create": "5f2403d5600300589003005800021fd6",
    },
    ("structs", "x86_64"): {  # machine_code_structs_x86_64.s
        "empty": (
            "535541544155415641574883ec084989fc488b1e488d6e084885db74"
            "664c8b6d004d01e54d89ef4c8b75084d85f675084d8b7d004d8b7510"
            "48837d1800741a4d85f674154c89ff488b7518e8b0ffffff4c037d10"
            "49ffceebe648837d0800751a498b7d0031f6ff156c01000031c04989"
            "450049894508498945104883c52048ffcbeb954883c408415f415e41"
            "5d415c5d5bc3660f1f440000"
        ),
        "create": "f30f1efabf01000000488b356001000031d2ff2520010000",
        "destroy": ("f30f1efa534889fb488b3539010000e83cffffff4889df5b31f6ff2508010000"),
        "convert_from_py": (
            "f30f1efa53554883ec084889fb4889f54889f7488b350e010000e811"
            "ffffff488b3dfa0000004889ee4889daff15de00000085c00f94c048"
            "83c4085d5bc36690"
        ),
        "convert_to_py": ("f30f1efa4889fe488b3dd2000000ff25c40000000f1f4000"),
        "finish": "f30f1efa488b35c5000000e9c8feffff",
        "resize": (
            "f30f1efa53554883ec084889fb4889f5488b35b1000000e8acfeffff"
            "b8010000004885ed74274889ef488b35a000000031d2ff1560000000"
            "4885c0741048890348896b0848896b10b8010000004883c4085d5bc3"
            "0f1f4000"
        ),
        "length": "f30f1efa488b4708c30f1f8000000000",
        "in_sequence": "f30f1efa488b055d000000480fafc6480307c30f1f440000",
        "in_array": "f30f1efa488b0545000000480fafc64801f8c30f1f440000",
    },
    ("structs", "aarch64"): {  # machine_code_structs_aarch64.s
        "empty": (
            "fd7bbca9f35301a9f55b02a9f76303a9fd030091f30300aa348440f8"
            "f50301aab40300b4b60240f9d602138bf70316aab80640f9780000b5"
            "d70240f9d80a40f9a10e40f9210100b4180100b4e00317aaa10e40f9"
            "ebffff97a00a40f9f702008b180700d1f9ffff17a00640f9e00000b5"
            "c00240f9010080d2900b005800023fd6df7e00a9df0a00f9b5820091"
            "940600d1e4ffff17f35341a9f55b42a9f76343a9fd7bc4a8c0035fd6"
        ),
        "create": "5f2403d5200080d2410b0058020080d25009005800021fd6",
        "destroy": (
            "5f2403d5fd7bbea9fd030091e00b00f9c1090058cbffff97e00b40f9"
            "fd7bc2a8010080d23008005800021fd61f2003d5"
        ),
        "convert_from_py": (
            "5f2403d5fd7bbea9fd030091e00701a9e00301aa21080058beffff97"
            "e20741a980070058f006005800023fd61f000071e0179f1afd7bc2a8"
            "c0035fd61f2003d5"
        ),
        "convert_to_py": ("5f2403d5e10300aa40060058f005005800021fd61f2003d5"),
        "finish": "5f2403d5e1050058acffff171f2003d5",
        "resize": (
            "5f2403d5fd7bbea9fd030091e00701a941050058a5ffff97e00f40f9"
            "200100b401050058020080d21003005800023fd6a00000b4e10b41a9"
            "200800a9220800f920008052fd7bc2a8c0035fd61f2003d5"
        ),
        "length": "5f2403d5000440f9c0035fd61f2003d5",
        "in_sequence": "5f2403d5e2020058000040f92000029bc0035fd61f2003d5",
        "in_array": "5f2403d5220200582000029bc0035fd6",
    },
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
    start = _executable(code + pack(f"={len(words)}Q", *words.values()))
    return {name: start + offset for name, offset in entries.items()}


def linked(kind: str, machine: str) -> tuple[bytes, dict[str, int]]:
    """Return all code for a processor, and the offset of each function in it."""
    parts = {name: bytes.fromhex(code) for name, code in CODE[kind, machine].items()}
    offsets = accumulate(map(len, parts.values()), initial=0)
    return b"".join(parts.values()), dict(zip(parts, offsets, strict=False))


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
