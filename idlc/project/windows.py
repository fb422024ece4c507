"""Differences of Windows: runs that wait for one another, processes, files that are open.

It is called, and imported, where `sys.platform` is "win32" only.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import time
from collections.abc import Iterator
from typing import Any

#: All runs of a user's wait for one another, wherever they write: they take milliseconds.
_MUTEX = "Local\\idlc-writes"
_WAITED = 258
_SYNCHRONIZE = 0x100000
_ACCESS_DENIED = 5
#: Seconds between attempts to move over a file that a scanner or an editor has open.
PAUSES = (0.01, 0.05, 0.2, 0.5)


def _kernel() -> Any:
    kernel: Any = ctypes.WinDLL("kernel32", use_last_error=True)  # type: ignore[attr-defined]
    for name in ("CreateMutexW", "OpenProcess"):
        getattr(kernel, name).restype = ctypes.c_void_p
    return kernel


@contextlib.contextmanager
def alone() -> Iterator[None]:
    """Wait until no other run writes, and let none begin meanwhile; ends with the process."""
    kernel = _kernel()
    handle = ctypes.c_void_p(kernel.CreateMutexW(None, False, _MUTEX))
    # in short steps, between which Ctrl-C is heard
    while kernel.WaitForSingleObject(handle, 100) == _WAITED:
        pass
    try:
        yield
    finally:
        kernel.ReleaseMutex(handle)
        kernel.CloseHandle(handle)


def is_running(number: int) -> bool:
    """Return whether there is a process of this number, which may be somebody else's."""
    kernel = _kernel()
    process = kernel.OpenProcess(_SYNCHRONIZE, False, number)
    if not process:
        return bool(ctypes.get_last_error() == _ACCESS_DENIED)  # type: ignore[attr-defined]
    handle = ctypes.c_void_p(process)
    running = kernel.WaitForSingleObject(handle, 0) == _WAITED
    kernel.CloseHandle(handle)
    return bool(running)


def replace(path: str, target: str) -> None:
    """Move a file over another one; wait a little for those who have that open."""
    for pause in PAUSES:
        with contextlib.suppress(PermissionError):
            os.replace(path, target)  # noqa: PTH105 - as everywhere in a transaction
            return
        time.sleep(pause)
    os.replace(path, target)  # noqa: PTH105
