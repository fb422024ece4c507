"""Access to Fast CDR's `Cdr` objects, whose layout is found out and never assumed.

Reading and writing go through three pointers inside `Cdr`: where the next byte is,
where the message began, and where the buffer ends. Each is the second word of a pair
whose first word is the start of the buffer. `fast_cdr` makes a `Cdr` of its own and
looks for these pairs; where it does not find them, it raises ImportError instead of
touching anybody's memory.
"""

from __future__ import annotations

import ctypes
import os
from ctypes import PYFUNCTYPE, c_char_p, c_int, c_size_t, c_void_p
from functools import cache
from typing import Any, NamedTuple

from . import c

_CDR = "_ZN8eprosima7fastcdr3Cdr"
_NEW_BUFFER = "_ZN8eprosima7fastcdr10FastBufferC1EPcm"
_NEW_CDR = f"{_CDR}C1ERNS0_10FastBufferENS1_10EndiannessE"
_LITTLE_ENDIAN = 1


class _Names(NamedTuple):
    """The names that a version of Fast CDR has for the needed functions."""

    libraries: tuple[str, ...]
    new: str
    plain: int  #: the constructor's value for plain CDR
    append: str
    position: str
    begin: str


_VERSIONS = (
    _Names(
        ("libfastcdr.so.2", "libfastcdr.2.dylib"),
        f"{_NEW_CDR}NS0_10CdrVersionE",
        2,
        f"{_CDR}15serialize_arrayEPKcm",
        f"{_CDR}20get_current_positionEv",
        f"{_CDR}18get_buffer_pointerEv",
    ),
    _Names(  # ROS 2 Humble
        ("libfastcdr.so.1", "libfastcdr.1.dylib"),
        f"{_NEW_CDR}NS1_7CdrTypeE",
        1,
        f"{_CDR}14serializeArrayEPKcm",
        f"{_CDR}18getCurrentPositionEv",
        f"{_CDR}16getBufferPointerEv",
    ),
)
#: Generous room for the C++ objects (200 and 40 bytes in Fast CDR 2.2).
_OBJECT_SIZE = 4096
_WORDS = 64
_ADVICE = (
    "idlc's type support for Fast DDS knows Fast CDR 1 and 2. Build the interface package "
    "with colcon instead, or use another middleware (RMW_IMPLEMENTATION=rmw_cyclonedds_cpp)"
)


class FastCdr(NamedTuple):
    """Where a `Cdr` keeps its pointers: indices of machine words in it."""

    position: int
    end: int


def _load() -> tuple[ctypes.CDLL, _Names]:
    """Return the Fast CDR that the middleware has already loaded, never another one."""
    names = [(name, version) for version in _VERSIONS for name in version.libraries]
    for name, version in names:
        try:
            return ctypes.CDLL(name, mode=os.RTLD_NOLOAD | os.RTLD_LAZY), version
        except OSError:
            continue
    tried = " or ".join(name for name, _ in names)
    raise ImportError(f"the middleware has not loaded {tried}. {_ADVICE}")


def _words(cdr: int) -> list[int]:
    return c.WORDS[cdr >> 3 : (cdr >> 3) + _WORDS].tolist()


def _find(words: list[int], begin: int, positions: tuple[int, int, int]) -> int | None:
    """Return the only index of the three pairs, else None."""
    pattern = [word for position in positions for word in (begin, position)]
    indices = [i for i in range(_WORDS - 6) if words[i : i + 6] == pattern]
    return indices[0] if len(indices) == 1 else None


@cache
def fast_cdr() -> FastCdr:
    """Return how to use the loaded Fast CDR; raises ImportError if that cannot be found out."""
    library, names = _load()

    def method(name: str, result: Any, *arguments: Any) -> Any:
        return PYFUNCTYPE(result, *arguments)((name, library))

    try:
        new_buffer = method(_NEW_BUFFER, None, c_void_p, c_void_p, c_size_t)
        new_cdr = method(names.new, None, c_void_p, c_void_p, c_int, c_int)
        append = method(names.append, c_void_p, c_void_p, c_void_p, c_size_t)
        position_of = method(names.position, c_void_p, c_void_p)
        begin_of = method(names.begin, c_void_p, c_void_p)
    except AttributeError as error:
        raise ImportError(f"this Fast CDR is unknown: {error}. {_ADVICE}") from error

    data = ctypes.create_string_buffer(64)
    begin, size = ctypes.addressof(data), len(data)
    buffer, cdr = (ctypes.create_string_buffer(_OBJECT_SIZE) for _ in range(2))
    here = ctypes.addressof(cdr)
    new_buffer(buffer, begin, size)
    new_cdr(cdr, buffer, _LITTLE_ENDIAN, names.plain)
    indices = set()
    for text in (b"\1\2\3", b"\4\5"):
        append(here, ctypes.cast(c_char_p(text), c_void_p), len(text))
        position = position_of(here)
        indices.add(_find(_words(here), begin, (position, begin, begin + size)))
    index = indices.pop()
    if (
        indices
        or index is None
        or begin_of(here) != begin
        or data.value != b"\1\2\3\4\5"
    ):
        raise ImportError(f"the layout of this Fast CDR is unknown. {_ADVICE}")
    layout = FastCdr(index + 1, index + 5)
    c.WORDS[(here >> 3) + layout.position] = begin + 1
    if position_of(here) != begin + 1:
        raise ImportError(f"the layout of this Fast CDR is unknown. {_ADVICE}")
    return layout
