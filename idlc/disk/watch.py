"""What a watched run depends on, as a value that differs when any of it changed."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from idlc.diagnostics.report import Report
from idlc.disk.find import look
from idlc.disk.packages.enclosing import MANIFEST


def snapshot(paths: Iterable[str], include: Iterable[str]) -> dict[str, tuple[int, int]]:
    """Return time and size of each input file, of its package.xml and of files along -I."""
    files = [file.path for file in look((*paths, *include), Report()).files]
    manifests = {path.parent.parent / MANIFEST for path in files}
    return stamps((*files, *sorted(manifests)))


def stamps(paths: Iterable[Path]) -> dict[str, tuple[int, int]]:
    """Return time and size of each file."""
    return {path.as_posix(): _stamp(path) for path in paths}


def _stamp(path: Path) -> tuple[int, int]:
    try:
        status = path.stat()
    except OSError:
        return (0, 0)
    return status.st_mtime_ns, status.st_size
