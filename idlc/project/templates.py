"""Templates that were compiled once, for the next run."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path

import jinja2
import msgspec

from idlc.diagnostics.text import printable


@cache
def folder() -> Path | None:
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


_PACKAGE = Path(__file__).parents[1]


class RenderedFile(msgspec.Struct, frozen=True):
    """A file to write: `path` with slashes, relative to the folder that is written."""

    path: str
    text: str


@cache
def environment() -> jinja2.Environment:
    """Return the environment of all templates: strict, without filters of our own."""
    folders = [_PACKAGE / "templates", _PACKAGE.parent / "templates"]
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(folders),
        undefined=jinja2.StrictUndefined,
        autoescape=False,  # noqa: S701 (Python source, escaped by emit.literals)
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        auto_reload=False,  # a look at the disk for each file that is written
    )


@cache
def html() -> jinja2.Environment:
    """Return the same for pages: whatever is placed is text, its control characters spelled out."""
    return environment().overlay(autoescape=True, finalize=_text)


def _text(value: object) -> object:
    return value if hasattr(value, "__html__") else printable(str(value))


def verbatim(name: str) -> str:
    """Return a file of the templates' folder that is no template."""
    loader = environment().loader
    assert loader is not None
    return loader.get_source(environment(), name)[0]


def keep() -> None:
    """Let templates be compiled once: to compile them takes longer than to fill them in."""
    if environment().bytecode_cache is not None:
        return
    place = folder()
    if place is not None:
        environment().bytecode_cache = _Compiled(place, "text")
        html().bytecode_cache = _Compiled(place, "html")


class _Compiled(jinja2.FileSystemBytecodeCache):
    """Compiled templates; each file holds the digest of its template and Python's version."""

    def __init__(self, place: Path, environment: str) -> None:
        pattern = f"template-{jinja2.__version__}-{sys.implementation.cache_tag}-{environment}-%s"
        super().__init__(str(place), pattern)

    def load_bytecode(self, bucket: jinja2.bccache.Bucket) -> None:
        try:
            super().load_bytecode(bucket)
        except Exception:  # what pickle and marshal raise for a damaged file
            bucket.reset()

    def dump_bytecode(self, bucket: jinja2.bccache.Bucket) -> None:
        if not sys.dont_write_bytecode:
            with suppress(OSError):  # a full disk
                super().dump_bytecode(bucket)
