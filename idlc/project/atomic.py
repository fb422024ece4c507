"""One writer at a time: a folder's lock, and signals that wait until a step is complete."""

from __future__ import annotations

import contextlib
import errno
import itertools
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from idlc.project.files import is_folder

#: All runs of one user wait for one another, wherever they write: they take milliseconds.
_MUTEX = "Local\\idlc-writes"
_WAITED = 258
#: Seconds between attempts to move over a file that a scanner or an editor has open.
PAUSES = (0.01, 0.05, 0.2, 0.5)


@contextlib.contextmanager
def only_writer_on_windows() -> Iterator[bool]:
    """Wait until no other run writes, and keep others out; the lock ends with the process."""
    import ctypes

    kernel: Any = ctypes.WinDLL("kernel32", use_last_error=True)  # type: ignore[attr-defined]
    kernel.CreateMutexW.restype = ctypes.c_void_p
    handle = ctypes.c_void_p(kernel.CreateMutexW(None, False, _MUTEX))
    # in short steps, between which Ctrl-C is heard
    while kernel.WaitForSingleObject(handle, 100) == _WAITED:
        pass
    try:
        yield True
    finally:
        kernel.ReleaseMutex(handle)
        kernel.CloseHandle(handle)


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[bool | None]:
    """Lock a folder until the end, or until the process ends.

    Gives False if another process has locked it, and `None` where folders cannot be locked.
    """
    try:
        import fcntl
    except ImportError:
        yield None
        return
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:
        yield False
        return
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
        except OSError:  # not on every network file system
            yield None
        else:
            yield True
    finally:
        os.close(handle)


_WRITING = os.O_WRONLY | os.O_CREAT | getattr(os, "O_BINARY", 0)


def move_over(path: str, target: str) -> None:
    """Move a file over another one; on Windows, retry while another process has that open."""
    for pause in PAUSES if sys.platform == "win32" else ():
        with contextlib.suppress(PermissionError):
            os.replace(path, target)  # noqa: PTH105
            return
        time.sleep(pause)
    os.replace(path, target)  # noqa: PTH105 - a Path costs as much as moving


def create(path: str, data: bytes, how: int = os.O_TRUNC, *, sync: bool = False) -> None:
    """Write a whole file or none; without `open`, which takes as long as the system's calls.

    With `sync` it is on the disk then.
    """
    handle = os.open(path, _WRITING | how, 0o666)
    try:
        try:
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(handle, rest) :]
            if sync:
                os.fsync(handle)
        finally:
            os.close(handle)  # first: Windows removes no file that is open
    except BaseException:
        with contextlib.suppress(OSError):
            Path(path).unlink()
        raise


def move_new(path: Path, target: Path) -> None:
    """Move a file or folder to a path that is free; raise FileExistsError if it is not."""
    if sys.platform != "win32" and path.is_file():
        try:
            os.link(path, target)  # which no other file can precede
        except FileExistsError:
            raise
        except OSError:  # some file systems have no links
            pass
        else:
            with contextlib.suppress(OSError):
                path.unlink()
            return
    if os.path.lexists(target):
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(target))
    path.rename(target)


def write_whole(target: Path, data: bytes, mode: int) -> None:
    """Give a file a content and a mode, as a whole or not at all, unless it has the content."""
    if not target.is_file() or target.read_bytes() != data:
        target.parent.mkdir(parents=True, exist_ok=True)
        draft = target.with_name(f"{target.name}.{os.getpid()}")
        create(str(draft), data)
        draft.chmod(mode)
        move_over(str(draft), str(target))


def make_folder(folder: Path, created: list[Path]) -> None:
    """Make a folder and those above it; add the ones that were not there to `created`."""
    missing = itertools.takewhile(lambda each: not is_folder(each), (folder, *folder.parents))
    for path in reversed(list(missing)):
        path.mkdir(exist_ok=True)
        created.append(path)


#: Whether the system keeps other runs away; `None` outside of `exclusive`.
_is_locked: ContextVar[bool | None] = ContextVar("_is_locked", default=None)


@contextlib.contextmanager
def exclusive(out: Path) -> Iterator[bool]:
    """Keep other runs from writing to a folder or beside it; yield whether the system can do so.

    The lock is one on the folder above, so it leaves no file and ends with the process. Windows
    has one lock for all folders. Some network drives lock nothing.
    """
    held = _is_locked.get()
    if held is not None:
        yield held
        return
    windows = sys.platform == "win32"
    with only_writer_on_windows() if windows else _locked(out.resolve().parent) as held:
        token = _is_locked.set(held)
        try:
            yield held
        finally:
            _is_locked.reset(token)


@contextlib.contextmanager
def _locked(folder: Path) -> Iterator[bool]:
    """Hold the lock on a folder, which is made for that time if it does not exist."""
    created: list[Path] = []
    handle = None
    try:
        handle = _lock(folder, created)
        yield handle is not None
    finally:
        for path in reversed(created):
            with contextlib.suppress(OSError):
                path.rmdir()
        if handle is not None:
            os.close(handle)


def _lock(folder: Path, created: list[Path]) -> int | None:
    """Return a handle that locks a folder; `None` if the system cannot."""
    import fcntl

    for _ in range(1000):
        try:
            make_folder(folder, created)
            handle = os.open(folder, os.O_RDONLY)
        except FileNotFoundError:
            # another run made a folder, and removed it again; or nobody can make one, as in /proc
            continue
        except OSError:
            return None
        try:
            fcntl.flock(handle, fcntl.LOCK_EX)
            if os.path.samestat(os.fstat(handle), folder.stat()):
                return handle
        except FileNotFoundError:
            pass
        except OSError:
            os.close(handle)
            return None
        os.close(handle)
    return None


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Defer signals that would end the process; if other threads exist, only Ctrl-C."""
    with without_ctrl_c():
        if sys.platform == "win32":
            yield
            return
        ending = (signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
        before = signal.pthread_sigmask(signal.SIG_BLOCK, ending)
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _EndedError(BaseException):
    """A signal is to end the process."""


@contextlib.contextmanager
def ended_by_errors() -> Iterator[None]:
    """Let signals that would end the process end what is done first, as an exception does."""
    received: list[int] = []

    def end(number: int, _: Any) -> None:
        received.append(number)
        if len(received) == 1:
            raise _EndedError

    is_main = threading.current_thread() is threading.main_thread()
    names = ("SIGTERM", "SIGHUP") if is_main else ()
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    mine = [number for number in numbers if signal.getsignal(number) is signal.SIG_DFL]
    for number in mine:
        signal.signal(number, end)
    try:
        yield
    finally:
        for number in mine:
            signal.signal(number, signal.SIG_DFL)
        if received:
            signal.raise_signal(received[0])


@contextlib.contextmanager
def without_ctrl_c() -> Iterator[None]:
    """Defer Ctrl-C, also if other threads exist; only the main thread receives it.

    A blocked signal would not be enough: the system can deliver it to any thread.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    pressed: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: pressed.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before or signal.SIG_DFL)
        if pressed:
            signal.raise_signal(signal.SIGINT)
