"""One writer at a time: a folder's lock, and signals that wait until a step is complete."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from idlc.diagnostics import codes
from idlc.diagnostics.report import apply
from idlc.project.files import is_folder, reason

if TYPE_CHECKING:
    from idlc.diagnostics.report import Edit, Report
    from idlc.project.root import Root

#: All runs of one user wait for one another, wherever they write: they take milliseconds.
_MUTEX = "Local\\idlc-writes"
_WAITED = 258
_SYNCHRONIZE = 0x100000
_ACCESS_DENIED = 5
#: Seconds between attempts to move over a file that a scanner or an editor has open.
PAUSES = (0.01, 0.05, 0.2, 0.5)


def _kernel() -> Any:
    import ctypes

    kernel: Any = ctypes.WinDLL("kernel32", use_last_error=True)  # type: ignore[attr-defined]
    for name in ("CreateMutexW", "OpenProcess"):
        getattr(kernel, name).restype = ctypes.c_void_p
    return kernel


@contextlib.contextmanager
def only_writer_on_windows() -> Iterator[None]:
    """Wait until no other run writes, and keep others out; the lock ends with the process."""
    import ctypes

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


def is_running_on_windows(number: int) -> bool:
    """Return whether there is a process of this number, which may be somebody else's."""
    import ctypes

    kernel = _kernel()
    process = kernel.OpenProcess(_SYNCHRONIZE, False, number)
    if not process:
        return bool(ctypes.get_last_error() == _ACCESS_DENIED)  # type: ignore[attr-defined]
    handle = ctypes.c_void_p(process)
    running = kernel.WaitForSingleObject(handle, 0) == _WAITED
    kernel.CloseHandle(handle)
    return bool(running)


def replace_patiently(path: str, target: str) -> None:
    """Move a file over another one; retry while another process has that open."""
    for pause in PAUSES:
        with contextlib.suppress(PermissionError):
            os.replace(path, target)  # noqa: PTH105 - as everywhere in a transaction
            return
        time.sleep(pause)
    os.replace(path, target)  # noqa: PTH105


_WRITING = os.O_WRONLY | os.O_CREAT | getattr(os, "O_BINARY", 0)


def move_over(path: str, target: str) -> None:
    """Move a file over another one."""
    if sys.platform == "win32":
        replace_patiently(path, target)
    else:
        os.replace(path, target)  # noqa: PTH105 - a Path costs as much as moving


def create(path: str, data: bytes, how: int = os.O_TRUNC) -> None:
    """Write a whole file or none; without `open`, which takes as long as the system's calls."""
    handle = os.open(path, _WRITING | how, 0o666)
    try:
        try:
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(handle, rest) :]
        finally:
            os.close(handle)  # first: Windows removes no file that is open
    except BaseException:
        with contextlib.suppress(OSError):
            Path(path).unlink()
        raise


if sys.platform != "win32":
    import fcntl

#: Folders that this process has locked, so that it does not wait for itself.
_locked_folders: set[Path] = set()


@contextlib.contextmanager
def exclusive(folder: Path) -> Iterator[None]:
    """Wait until no other idlc writes to a folder, and keep others out.

    The lock is the operating system's, on the folder itself, or on the nearest one above until it
    exists: it leaves no file and ends with the process. Where folders cannot be locked, nothing is
    locked; Windows has one lock for all folders. A run that holds one folder may only lock others
    below it.
    """
    place = _nearest(folder)
    if sys.platform == "win32" and not _locked_folders:
        with only_writer_on_windows(), _holding(place):
            yield
        return
    if sys.platform == "win32" or place in _locked_folders:
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
    _locked_folders.add(place)
    try:
        yield
    finally:
        _locked_folders.discard(place)


def _nearest(folder: Path) -> Path:
    return next((path for path in (folder, *folder.parents) if is_folder(path)), folder)


def _lock(place: Path) -> int | None:
    """Lock a folder, after runs that locked one above it because it did not exist yet."""
    for above in reversed(place.parents):
        if above not in _locked_folders:
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
    """Return whether a handle still is for the folder of this name, or there is no handle."""
    try:
        return handle is None or os.path.samestat(os.fstat(handle), place.stat())
    except OSError:
        return False


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Defer signals that would end the process."""
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
    """Defer Ctrl-C where signals cannot be blocked; only the main thread receives it."""
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


def rewrite(path: Path, name: str, old: str, new: str, report: Report) -> bool:
    """Give a file new content; report IDL612 and return `False` if that fails.

    A link stays one, and the file that it leads to is replaced. A file that was changed since it
    was read is not overwritten.
    """
    import shutil
    import tempfile

    target = path.resolve()
    try:
        if target.read_bytes() != old.encode("utf-8"):
            message = f"`{name}` was changed while idlc was running"
            report.add(codes.CANNOT_WRITE.of(name, message, hint="run it again"))
            return False
        handle, draft = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(new.encode("utf-8"))
            shutil.copymode(target, draft)
            move_over(draft, str(target))
        except BaseException:
            with contextlib.suppress(OSError):
                Path(draft).unlink()
            raise
    except OSError as error:
        report.add(codes.CANNOT_WRITE.of(name, f"cannot write `{name}`: {reason(error)}"))
        return False
    return True


def edit(
    edits: Iterable[Edit], root: Root, report: Report, keep_layout: Callable[[str, str, str], str]
) -> int:
    """Apply edits to their files; return the number of applied edits.

    `keep_layout` takes a file's name, its old text and its edited text, and returns the new text.
    """
    by_path: dict[str, list[Edit]] = {}
    for edit in edits:
        by_path.setdefault(edit.span.source.path, []).append(edit)
    done = 0
    for name, own in by_path.items():
        old = own[0].span.source.text
        text, number = apply(old, own)
        if rewrite(Path(root.path(name)), name, old, keep_layout(name, old, text), report):
            done += number
    return done
