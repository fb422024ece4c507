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
from base64 import b85decode
from collections.abc import Callable
from ctypes import c_char_p, c_int, c_size_t, c_uint8, c_uint64, c_void_p, py_object
from functools import cache
from importlib import import_module
from itertools import accumulate, repeat
from typing import Any, TypeVar

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

# `rosidl_runtime_c__type_description__Field`, with its FieldType, and so on
Field = structure(
    "Field",
    name=String,
    type_id=c_uint8,
    capacity=c_uint64,
    string_capacity=c_uint64,
    nested_type_name=String,
    default_value=String,
)
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
#: `service_type_support_callbacks_t`, and `ServiceMembers` of introspection, which has all three.
ServiceMembers = structure(
    "ServiceMembers", namespace=c_char_p, name=c_char_p, messages=c_void_p * 3
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


#: What to do where ROS 2 is not found.
ADVICE = (
    "install ROS 2's rclpy and a middleware (for example `pip install ros-jazzy-rclpy "
    "ros-jazzy-rmw-fastrtps-cpp`), or source your ROS 2 installation first"
)


def load_library(name: str) -> ctypes.CDLL:
    """Return a shared library of ROS 2; raises ImportError that says what to do."""
    try:
        return ctypes.CDLL(name)
    except OSError as error:
        raise ImportError(f"{name} cannot be loaded ({error}): {ADVICE}") from error


@cache
def identifier(name: str) -> int:
    """Return the address of a type support's own string: middlewares compare the pointers."""
    library = load_library(f"lib{name}.so")
    return c_void_p.in_dll(library, f"{name}__identifier").value or 0


def namespace_and_name(type_name: str, separator: str) -> tuple[bytes, bytes]:
    """Return what C calls a type."""
    package, kind, short = type_name.encode().split(b"/")
    return package + separator.encode() + kind, short


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


# functions in Python

#: Arguments of the interpreter's RESUME instruction.
_AT_START, _IN_YIELD_FROM = 0, 2


def callback(prototype: Any, function: Callable[..., object]) -> int:
    """Return the C function that calls `function`, a `try` that catches everything."""
    return address(prototype(deaf(function)))


def deaf(function: Any) -> Callable[..., Any]:
    """Change a function, which begins with `try`, so that no signal interrupts before that.

    Signal handlers run on entry of a Python function, before its first `try`, and what
    they raise would be lost with the result. The interpreter does not look for signals
    where a function resumes inside a `yield from`, so the function is made to look like one.
    (Python 3.10 has no such instruction; it does not look before a leading `try` either.)
    """
    raw = bytearray(function.__code__.co_code)
    resume = opcode.opmap.get("RESUME")
    at = next((at for at in range(0, len(raw), 2) if raw[at] == resume), None)
    if at is not None and raw[at + 1] == _AT_START:
        raw[at + 1] = _IN_YIELD_FROM
    function.__code__ = function.__code__.replace(co_code=bytes(raw))
    return function  # type: ignore[no-any-return]


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
#: Their code by processor, in base 85, with spaces between them. A test assembles the text
#: that is named and compares.
CODE = {
    ("fastrtps", "x86_64"): (  # machine_code_fastrtps_x86_64.s
        "^A8^SQ&mA!K~+eD>=-e?NQ)iO0RR9<iyR+Fh1+ywNCO?w0RR9@iz`Tj!w5)=Eu#Sd07wD#Op9dzNQ)"
        "Jn0RR9<ixd`2DdJ2y>T)Vgh3#}4Oo``6i!(@zQwT``)JZAT{}oOF002mX!w~D=Oo?RxxB&nF07!$x7"
        "(rb@TwPnkNQ)J90RR9<ixd|~h0=88NQ)h90RR9@i!2&RgY5)J0~JmI002mX!URZ(6eLWEY$OOsiR0;"
        "S|NsAx ^A8^SQ%H&PNQ(st0RR9<iv$NqgXjcEi!}lP002mfG&e{o#z=|B{}s{z002mZz;qf&10D7N0"
        "02mfJ4lHG{}sXj006iF00016!~Ye%0000nz+1zR ^A8^SNQ(u<0000;iv$Nqg}`(RNCO4M0000;ivY"
        "t&iv_{}002mf1P4fkz;q8tixs*6002mf1Q1Ar=mf)% ^A8^S#s>f~z{6$_A4C8E ^A8^SNQ)Jn0000"
        ";ivmc6z;q!<iSa~=07N<gbr4AZz)1hWMTEe0?MRD42*XH&!Vv4%!w(+- ^A8^SNQ*sf00030C2s%#0"
        "1qF400000"
    ),
    ("fastrtps", "aarch64"): (  # machine_code_fastrtps_aarch64.s
        "UnB$7{d>Hr^HTw-^;-g|{R04za}NMm6KHeza{~ahf)4;#a{>a3c7{Os004ke6b=AblmY>Zl>$Kd;tc"
        ">;B4}dxLI4%ZUjP>CV*vnE76AaX-~$z^VG6;hwE_Z*)&c^{a0>uf00KYO`TzeHl>z|yAOL_;^HV{o^"
        ";<%z{d>fyzyn{_f(!sy0%&6R004keBLDxiLks{|R%m1R))D~GV+#OSLI4AcLJ$Cv^TPm<Vp;&H-T(g"
        "=A0PwO UnB$7{d>Nt^9um^{R04z^8*2@;s^j(0%&6RLJ$Da!3Y3Y0cc_PApio)-~$4xPzL~500KYOK"
        "mh=>Vh8|Oa{>a3VFEz;U;+U7-~$1wkOlx)00KYOAOL_;1ONaOPzC^400KYO004ke^9w-v{d>Zwzyn{"
        "_ UnB$7AqD_g0cc_PfdBxsKn4I<AZTFtzyn{_AqD_g0BB+OfB*or0R{kA0BB+O01yDtzyn{_ UnB$7"
        "9{>P3004l}zyn{_ UnB$7A_V|gLjXYeV*voP<O2b!WfVX-h7>?JzW@enfdBwhh5!FGKm<Vfzyn{_LO"
        "=kK_5c4D004l}zyn{_ UnB$7U;_YHkOKf%00JM@"
    ),
    ("structs", "x86_64"): (  # machine_code_structs_x86_64.s
        "Q&mA!K~+IkL03qF><CGT{78!)NR4g?NQK*UW=xB108IhqO^NSJi**Q1h4ys_O^ba1O^bC9NP~SC0CX"
        "Bnh4yq6Oo{(Ui**?2u>b%6OapxoN&n94=17Bm2mo~&NsD~|G4}rzYykiOF~CWQMF2^OMF>fWMG#1X#"
        "UM!k%j=a$gTx3yUqN0$T|r!3Tf=4#A4C8E ^A8^SzX1RM07#29U;zLCG1C7fAOQdX ^A8^SQ%H&XNQ"
        "*T&0RRB#JpcdyNQvKDG4}r@2mt^9 ^A8^SQ&mWV><CDS`$&oPNQw7Ii!}}b008I_|Ns9;i#_@P002m"
        "d?nsH+{}tW<004!+50t=2gTx43Tf=6M ^A8^SNQwSPi#^f+0093b!~g&Q4<A4P ^A8^SNQ*Va0002#"
        "$o~KT ^A8^SQ&mWV><CDS`$&oPNQ*VG0002!tp5N1xB&nF07!-HbSFrO??{U^pa1{>G1C7PU;qFBNQ"
        "J<35J-swNQr9*NQr9@xB&nF07!$x2whvl4<A4P ^A8^SNQ*}Z!w(;T00000 ^A8^SNQ(ts0000;53j"
        "~Z0|&zoA4C8E ^A8^SNQ(tU0000;53j~Z0r<lYA4C8E"
    ),
    ("structs", "aarch64"): (  # machine_code_structs_aarch64.s
        "{d>Hr^HTw-^;-g|_hSR8{R04z^8)~?G=xC-^#cK_v;zRNwgN!;)&diY_X8HHxCTJ^cmM#k*8)KK*a|"
        "@Tp$<U#Aproi7y$sZ-~$(`p$<U#>;M0kpb9|w_W}Tm7zY5+`TzeHpawws-~a%%zyd(|0RVu~kP84<0"
        "0KYO-+ln8-wFWvwSoYVlm-CN<p2K{^HV{o^;<%z_hUn;{d>fyzyn{_ UnB$7AOL{UK??v_0sw&0Pze"
        "B700JM@ UnB$7{d>Nt{R04z;0plx!3h9Z%m4qE;0r+c{d>Zw0RVu~FbDux00JM@A0PwO UnB$7{d>N"
        "t{R04z;0FPz-~$1wAqW6izW@K1;s-&gfCm6r@CE=_00KYO9{>Px;1{17{d>Zwzyn{_A0PwO UnB$7;"
        "R67wKn4I<@C5)^00JM@A0PwO UnB$7;ROI#tpEQPA0PwO UnB$7{d>Nt{R04z;0FPzK?ML<rT_nz;1"
        "59gAOQfh0R;e90sw&05CZ^M00KYOpa1~0;R`{jAP4}dA_xHaAOL_;{d>Zwzyn{_A0PwO UnB$700cn"
        "!zyn{_A0PwO UnB$7;sO9z002PwAOHfJzyn{_A0PwO UnB$7A_4$dAOHfJzyn{_"
    ),
}


class RefusedError(Exception):
    """There can be no machine code here: why."""


def machine_code(kind: str, words: dict[str, int]) -> dict[str, int]:
    """Return the addresses of functions by name; they live as long as the process.

    `kind` names the type support, `fastrtps` or `structs`. `words` is what their code
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
    parts = [b85decode(code) for code in CODE[kind, machine].split()]
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
    permissions = (_READ_AND_EXECUTE, _MAP_PRIVATE)
    try:
        with os.fdopen(os.memfd_create("idlc"), "wb", 0) as file:
            file.write(code)
            start = library.mmap(None, len(code), *permissions, file.fileno(), 0)
        if start == -1:
            raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    except (AttributeError, OSError) as error:
        raise RefusedError(f"this system does not allow it ({error})") from error
    return int(start)
