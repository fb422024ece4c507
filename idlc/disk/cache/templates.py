"""Templates that were compiled once, for the next run."""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path

import jinja2

from idlc import templating
from idlc.disk.cache import place as cache


def keep() -> None:
    """Let templates be compiled once: to compile them takes longer than to fill them in."""
    if templating.environment().bytecode_cache is not None:
        return
    place = cache.folder()
    if place is not None:
        templating.environment().bytecode_cache = _Compiled(place, "text")
        templating.html().bytecode_cache = _Compiled(place, "html")


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
