"""One writer at a time: a folder's lock, and signals that wait until a step is complete."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

from idlc.disk.read import is_folder

#: What this process has locked, so that it does not wait for itself.
_held: set[Path] = set()


@contextlib.contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Wait until no other idlc writes to a folder, and let none begin meanwhile.

    The lock is the operating system's, on the folder itself, or the nearest above as long as
    there is none: it leaves no file behind and ends with the process. Where folders cannot be
    locked, nothing is.
    """
    place = next((one for one in (folder, *folder.parents) if is_folder(one)), folder)
    if sys.platform == "win32" or place in _held:
        yield
        return
    import fcntl

    handle = None
    with contextlib.suppress(OSError):
        handle = os.open(place, os.O_RDONLY)
        fcntl.flock(handle, fcntl.LOCK_EX)
        _held.add(place)
    try:
        yield
    finally:
        _held.discard(place)
        if handle is not None:
            os.close(handle)


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Let signals that would end the process wait."""
    if sys.platform == "win32":
        yield
        return
    ending = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ending)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
