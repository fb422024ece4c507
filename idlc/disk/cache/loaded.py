"""The packages that `idlc.load` compiled, kept for other runs and other processes."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from shutil import rmtree

from idlc.disk.cache.place import folder as caches
from idlc.disk.output.up_to_date import last_change
from idlc.templating import RenderedFile


@cache
def folder() -> Path:
    """Return where packages are kept, by default with idlc's other caches.

    Where nothing can be kept, it is a folder that lives as long as this process.
    """
    chosen = os.environ.get("IDLC_CACHE")
    base = Path(chosen) if chosen else caches()
    try:
        if base is not None:
            place = base / "loaded"
            place.mkdir(mode=0o700, parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=place):
                return place
    except OSError:
        pass
    import atexit

    made = tempfile.mkdtemp(prefix="idlc-")
    atexit.register(rmtree, made, ignore_errors=True)
    return Path(made)


def has(name: str) -> bool:
    """Return whether packages are there under a name."""
    return (folder() / name).is_dir()


def keep(name: str, files: Iterable[RenderedFile]) -> None:
    """Write packages under a name, whole or not at all; what another process wrote stays."""
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


@cache
def newest() -> int:
    """Return when idlc itself was changed last: its version does not change with each edit."""
    package = Path(__file__).parents[2]
    return last_change((package, package.parent / "templates"))
