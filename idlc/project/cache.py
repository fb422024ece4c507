"""The folder of what idlc can always make again."""

from __future__ import annotations

import os
import sys
from functools import cache
from pathlib import Path


@cache
def cache_folder() -> Path | None:
    """Return this user's folder of idlc's caches, made if need be; `None` if nothing can be kept.

    What is kept there is run. So it is only used where nobody else can write.
    """
    base = _base()
    if base is None:
        return None
    place = base / "idlc"
    try:
        there = next(one for one in (place, *place.parents) if one.exists())
        if not _is_ours(there):  # `sudo idlc` leaves nothing in another user's home
            return None
        place.mkdir(mode=0o700, parents=True, exist_ok=True)
        private = _is_ours(place) and not _is_open(place)
        return place if private and os.access(place, os.W_OK) else None
    except OSError:
        return None


def _base() -> Path | None:
    """Return where this system wants caches."""
    if sys.platform == "win32":
        told = os.environ.get("LOCALAPPDATA", "")
    else:
        told = os.environ.get("XDG_CACHE_HOME", "")
    if Path(told).is_absolute():
        return Path(told)
    try:
        home = Path.home()
    except RuntimeError:
        return None
    return home / ("Library/Caches" if sys.platform == "darwin" else ".cache")


def _is_open(path: Path) -> bool:
    """Return whether others may write, of which modes say nothing on Windows."""
    return sys.platform != "win32" and bool(path.stat().st_mode & 0o022)


def _is_ours(path: Path) -> bool:
    return sys.platform == "win32" or path.stat().st_uid == os.getuid()
