"""Files as a whole: written or not at all, and moved over others."""

from __future__ import annotations

import contextlib
import os
import sys
from pathlib import Path

_WRITING = os.O_WRONLY | os.O_CREAT | getattr(os, "O_BINARY", 0)


def replace(path: str, target: str) -> None:
    """Move a file over another one."""
    if sys.platform == "win32":
        from idlc.disk.output import windows

        windows.replace(path, target)
    else:
        os.replace(path, target)  # noqa: PTH105 - a Path costs as much as moving


def create(path: str, data: bytes, how: int = os.O_TRUNC) -> None:
    """Write a whole file or none; past `open`, which takes as long as the operating system."""
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
