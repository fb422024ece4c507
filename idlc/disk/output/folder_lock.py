"""One writer at a time: a folder's lock, and signals that wait until a step is complete."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

from idlc.disk.read import is_folder

if sys.platform != "win32":
    import fcntl

#: What this process has locked, so that it does not wait for itself.
_held: set[Path] = set()


@contextlib.contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Wait until no other idlc writes to a folder, and let none begin meanwhile.

    The lock is the operating system's, on the folder itself, or the nearest above as long as
    there is none: it leaves no file and ends with the process. Where folders cannot be
    locked, nothing is; on Windows one lock is for all. A run that holds one folder may only ask
    for others below it.
    """
    place = _nearest(folder)
    if sys.platform == "win32" and not _held:
        from idlc.disk.output import windows

        with windows.alone(), _holding(place):
            yield
        return
    if sys.platform == "win32" or place in _held:
        yield
        return
    handle = _lock(place)
    while (now := _nearest(folder)) != place or not _is(handle, place):
        _unlock(handle)
        handle = _lock(place := now)
    try:
        with _holding(place):
            yield
    finally:
        _unlock(handle)


@contextlib.contextmanager
def _holding(place: Path) -> Iterator[None]:
    _held.add(place)
    try:
        yield
    finally:
        _held.discard(place)


def _nearest(folder: Path) -> Path:
    return next((one for one in (folder, *folder.parents) if is_folder(one)), folder)


def _lock(place: Path) -> int | None:
    """Lock a folder, after those who locked one above it because this one was not there yet."""
    for above in reversed(place.parents):
        if above not in _held:
            _unlock(_opened(above, fcntl.LOCK_SH))
    return _opened(place, fcntl.LOCK_EX)


def _opened(place: Path, how: int) -> int | None:
    """Return a handle that locks a folder, `None` if it cannot be opened."""
    try:
        handle = os.open(place, os.O_RDONLY)
    except OSError:
        return None
    with contextlib.suppress(OSError):
        fcntl.flock(handle, how)
    return handle


def _unlock(handle: int | None) -> None:
    if handle is not None:
        os.close(handle)


def _is(handle: int | None, place: Path) -> bool:
    """Return whether a handle is still that of the folder of this name, or there is none."""
    try:
        return handle is None or os.path.samestat(os.fstat(handle), place.stat())
    except OSError:
        return False


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Let signals that would end the process wait."""
    if sys.platform == "win32":
        with _without_ctrl_c():
            yield
        return
    ending = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ending)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _without_ctrl_c() -> Iterator[None]:
    """Let Ctrl-C wait where signals cannot be blocked; only the main thread hears it."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    pressed: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: pressed.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if pressed:
            signal.raise_signal(signal.SIGINT)
