"""What a watched run depends on, as a value that differs when any of it changed."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TypeAlias

from idlc.diagnostics.report import Report
from idlc.disk.find import look
from idlc.disk.packages.enclosing import MANIFEST
from idlc.disk.read import absolute

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
    """What folders were before they were listed, and files when they were read.

    That began at a time in nanoseconds.
    """

    def __init__(
        self, folders: Mapping[Path, os.stat_result], files: Iterable[Path], begun: int
    ) -> None:
        now = time.time_ns()
        self._stamps = {absolute(path): _stamp_of(status) for path, status in folders.items()}
        for path in files:
            stamp = _stamp(path)
            # what changed since then was perhaps read before that
            is_new = any(begun - TICK <= at <= now for at in stamp[:2])
            self._stamps[path] = _UNKNOWN if is_new else stamp

    def is_true(self) -> bool:
        """Return whether they surely still are the same."""
        return all(stamp == _stamp(path) for path, stamp in self._stamps.items())


def _stamp(path: Path) -> Stamp:
    try:
        return _stamp_of(path.stat())
    except (OSError, ValueError):
        return _NO_FILE


def _stamp_of(status: os.stat_result) -> Stamp:
    return status.st_mtime_ns, status.st_ctime_ns, status.st_size, status.st_ino
