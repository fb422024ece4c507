"""What a watched run depends on, as a value that differs when any of it changed."""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path
from typing import TypeAlias

from idlc.diagnostics.report import Report
from idlc.disk.find import look
from idlc.disk.packages.enclosing import MANIFEST

#: When a file was written and last changed, its size and its number: all 0 if there is none.
Stamp: TypeAlias = tuple[int, int, int, int]
#: Nanoseconds; changes within a tick of a file system's clock may have the same time.
TICK = 20_000_000
_NO_FILE = (0, 0, 0, 0)
_UNKNOWN = (-1, 0, 0, 0)


def snapshot(paths: Iterable[str], include: Iterable[str]) -> dict[str, Stamp]:
    """Return the stamp of each input file, of its package.xml and of files along -I."""
    files = [file.path for file in look((*paths, *include), Report()).files]
    manifests = {path.parent.parent / MANIFEST for path in files}
    return stamps((*files, *sorted(manifests)))


def stamps(paths: Iterable[Path]) -> dict[str, Stamp]:
    """Return the stamp of each file or folder."""
    return {path.as_posix(): _stamp(path) for path in paths}


class Picture:
    """What files and folders were when they were read, which began at a time in nanoseconds."""

    def __init__(self, paths: Iterable[Path], begun: int) -> None:
        now = time.time_ns()
        # what changed since then was perhaps read before that
        self._stamps = {
            path: _UNKNOWN if any(begun - TICK <= at <= now for at in stamp[:2]) else stamp
            for path in paths
            for stamp in (_stamp(path),)
        }

    def is_true(self) -> bool:
        """Return whether they surely still are the same."""
        return all(stamp == _stamp(path) for path, stamp in self._stamps.items())


def _stamp(path: Path) -> Stamp:
    try:
        status = path.stat()
    except (OSError, ValueError):
        return _NO_FILE
    return status.st_mtime_ns, status.st_ctime_ns, status.st_size, status.st_ino
