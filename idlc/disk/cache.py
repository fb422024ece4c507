"""What idlc keeps for another run, and can make again at any time."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from shutil import rmtree

from idlc.templating import RenderedFile


@cache
def folder() -> Path:
    """Return the folder of this user's cache, or one for this process if there can be none."""
    try:
        chosen = os.environ.get("IDLC_CACHE")
        found = Path(chosen) if chosen else _home() / "idlc"
        found.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=found):
            return found
    except (OSError, RuntimeError):
        import atexit

        made = tempfile.mkdtemp(prefix="idlc-")
        atexit.register(rmtree, made, ignore_errors=True)
        return Path(made)


def _home() -> Path:
    """Return where programs of this user keep such things."""
    if chosen := os.environ.get("XDG_CACHE_HOME"):
        return Path(chosen)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData/Local")
    return Path.home() / ("Library/Caches" if sys.platform == "darwin" else ".cache")


def keep(name: str, files: Iterable[RenderedFile]) -> None:
    """Write a folder of the cache, whole or not at all; what another process wrote stays."""
    target = folder() / name
    made = Path(tempfile.mkdtemp(dir=folder(), prefix=".new-"))
    try:
        for file in files:
            path = made / file.path
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(file.text, encoding="utf-8")
        try:
            made.rename(target)
        except OSError:
            if not target.is_dir():
                raise
    finally:
        rmtree(made, ignore_errors=True)


def has(name: str) -> bool:
    """Return whether the cache has a folder."""
    return (folder() / name).is_dir()


@cache
def newest() -> int:
    """Return when idlc itself was changed last: its version does not change with each edit."""
    package = Path(__file__).parents[1]
    templates = (package / "templates", package.parent / "templates")
    files = [*package.rglob("*.py"), *(file for one in templates for file in one.rglob("*.jinja"))]
    return max(file.stat().st_mtime_ns for file in files)
