"""A bar that shows how much of something is done, for people who look at a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO

from idlc.diagnostics.visible import one_line

WIDTH = 30


@contextmanager
def shown(stream: TextIO) -> Iterator[Callable[[str, int, int], None]]:
    """Give a function to tell what is done of how many; the bar goes away at the end."""
    if not stream.isatty():
        yield lambda _what, _done, _total: None
        return
    size = 0

    def tell(what: str, done: int, total: int) -> None:
        nonlocal size
        full = WIDTH * min(done, total) // max(total, 1)
        line = f"{'█' * full}{'░' * (WIDTH - full)} {done:,} of {total:,}  {one_line(what)[:40]}"
        stream.write(f"\r{line.ljust(size)}")
        stream.flush()
        size = len(line)

    try:
        yield tell
    finally:
        stream.write(f"\r{' ' * size}\r")
