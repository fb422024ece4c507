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

_LIBRARIES = ("libfastcdr.so.2", "libfastcdr.2.dylib")
_CDR = "_ZN8eprosima7fastcdr3Cdr"
_NEW_BUFFER = "_ZN8eprosima7fastcdr10FastBufferC1EPcm"
_NEW_CDR = f"{_CDR}C1ERNS0_10FastBufferENS1_10EndiannessENS0_10CdrVersionE"
_LITTLE_ENDIAN, _XCDR_V1 = 1, 2
#: Generous room for the C++ objects (200 and 40 bytes in Fast CDR 2.2).
_OBJECT_SIZE = 4096
_WORDS = 64
_ADVICE = (
    "idlc's type support for Fast DDS was made for Fast CDR 2.x. Build the interface package "
    "with colcon instead, or use another middleware (RMW_IMPLEMENTATION=rmw_cyclonedds_cpp)"
)


class FastCdr(NamedTuple):
    """Where a `Cdr` keeps its pointers: indices of machine words in it."""

    position: int
    end: int


def _load() -> ctypes.CDLL:
    """Return the Fast CDR that the middleware has already loaded, never another one."""
    for name in _LIBRARIES:
        try:
            return ctypes.CDLL(name, mode=os.RTLD_NOLOAD | os.RTLD_LAZY)
        except OSError:
            continue
    raise ImportError(
        f"the middleware has not loaded {' or '.join(_LIBRARIES)}. {_ADVICE}"
    )


def _words(cdr: int) -> list[int]:
    return c.WORDS[cdr >> 3 : (cdr >> 3) + _WORDS].tolist()


def _find(words: list[int], begin: int, positions: tuple[int, int, int]) -> int | None:
    """Return the only index of the three pairs, else None."""
    pattern = [word for position in positions for word in (begin, position)]
    found = [i for i in range(_WORDS - 6) if words[i : i + 6] == pattern]
    return found[0] if len(found) == 1 else None


@cache
def fast_cdr() -> FastCdr:
    """Return how to use the loaded Fast CDR; raises ImportError if that cannot be found out."""
    library = _load()

    def method(name: str, result: Any, *arguments: Any) -> Any:
        return PYFUNCTYPE(result, *arguments)((name, library))

    try:
        new_buffer = method(_NEW_BUFFER, None, c_void_p, c_void_p, c_size_t)
        new_cdr = method(_NEW_CDR, None, c_void_p, c_void_p, c_int, c_int)
        append = method(
            f"{_CDR}15serialize_arrayEPKcm", c_void_p, c_void_p, c_void_p, c_size_t
        )
        position_of = method(f"{_CDR}20get_current_positionEv", c_void_p, c_void_p)
        begin_of = method(f"{_CDR}18get_buffer_pointerEv", c_void_p, c_void_p)
    except AttributeError as error:
        raise ImportError(f"this Fast CDR is unknown: {error}. {_ADVICE}") from error

    data = ctypes.create_string_buffer(64)
    begin, size = ctypes.addressof(data), len(data)
    buffer, cdr = (ctypes.create_string_buffer(_OBJECT_SIZE) for _ in range(2))
    here = ctypes.addressof(cdr)
    new_buffer(buffer, begin, size)
    new_cdr(cdr, buffer, _LITTLE_ENDIAN, _XCDR_V1)
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
    found = FastCdr(index + 1, index + 5)
    c.WORDS[(here >> 3) + found.position] = begin + 1
    if position_of(here) != begin + 1:
        raise ImportError(f"the layout of this Fast CDR is unknown. {_ADVICE}")
    return found
