"""What Fast DDS calls, in Python: for systems where there can be no machine code.

Nothing here lets another thread run: the interpreter may do so after a call and where it
jumps, so there is neither. Only Python 3.11 and older may collect garbage in between.
"""

from __future__ import annotations

import ctypes
from ctypes import PYFUNCTYPE, c_bool, c_char, c_size_t, c_void_p, py_object
from functools import cache
from typing import Any

from . import c, callbacks
from .fastcdr import fast_cdr

_HEADER = 4


def functions(answers: dict[bytes, int]) -> dict[str, int]:
    """Return the addresses of the functions by name; `answers` is what one of them gives."""
    return {
        "serialize": _serializer(),
        "deserialize": _deserializer(),
        "serialized_size": _size(),
        "maximum_size": _unbounded(),
        "resolve": c.resolver(answers),
    }


def memory_type(base: type) -> type:
    """Return a type of memory that knows what the functions here could not find out."""
    store: Any = base.__dict__["__rmatmul__"]

    def store_plain(memory: Any, message: Any) -> object:
        done = store(memory, message)
        memory.body = memory.body[_HEADER:]
        memory.size = len(memory.body)
        return done

    return type("Memory", (base,), {"__slots__": ("size",), "__rmatmul__": store_plain})


@cache
def _serializer() -> int:
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

    return callbacks.callback(PYFUNCTYPE(c_bool, py_object, c_void_p), serialize)


@cache
def _deserializer() -> int:
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
def _size() -> int:
    def size(memory: Any) -> int:
        try:
            return memory.size  # type: ignore[no-any-return]
        except BaseException:
            return 0

    return callbacks.callback(PYFUNCTYPE(c_size_t, py_object), size)


@cache
def _unbounded() -> int:
    def maximum(bounds_info: Any) -> int:
        try:  # noqa: SIM105 (a context manager would be called outside of it)
            bounds_info[0] = b"\0"
        except BaseException:  # noqa: S110
            pass
        return 0

    return callbacks.callback(PYFUNCTYPE(c_size_t, ctypes.POINTER(c_char)), maximum)
