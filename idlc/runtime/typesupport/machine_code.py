"""Functions that a middleware may call wherever it is, because no Python runs in them.

A middleware calls what a type support holds while it has locks of its own, and from any
thread. Whoever waits there for the interpreter's lock, or gives it away, can wait for
ever for a thread that wants such a lock. So these functions are machine code: a few
hundred bytes that are the same for all types, and words that differ from type to type.
"""

from __future__ import annotations

import ctypes
import os
from ctypes import c_int, c_size_t, c_ssize_t, c_void_p
from importlib import import_module
from struct import pack

#: Machines that there is code for.
_MACHINES = ("x86_64", "aarch64")
_MAP_PRIVATE = 2
_READ_AND_EXECUTE = 1 | 4


class RefusedError(Exception):
    """There can be no machine code here: why."""


def functions(kind: str, words: dict[str, int]) -> dict[str, int]:
    """Return the addresses of functions by name; they live as long as the process.

    `kind` is that of the type support, `fastrtps` or `structs`. `words` is what their code
    reads, in the order in which it follows the code. Raises RefusedError.
    """
    machine = os.uname().machine
    if machine not in _MACHINES:
        raise RefusedError(f"there is none for {machine}")
    module = import_module(f"{__package__}.{kind}_{machine}")
    start = _executable(module.CODE + pack(f"={len(words)}Q", *words.values()))
    return {name: start + offset for name, offset in module.ENTRIES.items()}


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
