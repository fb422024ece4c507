"""What is built in, as files that can only be read, for editors that cannot show it otherwise."""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from pathlib import Path

from idlc.diagnostics.source import Source
from idlc.disk.cache import place as cache

FOLDER = "interfaces"


def inside(source: Source) -> str:
    """Return what a text of the catalogue is, such as `jazzy/std_msgs/msg/Header.msg`."""
    return source.path.replace("<", "", 1).replace(">", "", 1)


def file_of(source: Source) -> Path | None:
    """Return a file of this user's cache that holds a text of the catalogue; `None` if none can."""
    base = cache.folder()
    if base is None:
        return None
    path = base / FOLDER / inside(source)
    data = source.text.encode()
    try:
        if not path.is_file() or path.read_bytes() != data:
            _write(path, data)
    except OSError:
        return None
    return path


def _write(path: Path, data: bytes) -> None:
    """Put a file that can only be read in the place of what is there, at once."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        Path(name).chmod(0o444)
        Path(name).replace(path)
    except OSError:
        with suppress(OSError):
            Path(name).unlink()
        raise
