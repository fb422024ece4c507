"""The working folder of a run: paths in messages and settings are seen from it."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def working_in(folder: Path) -> Iterator[None]:
    """Work in a folder, as after `cd`; one that is gone raises OSError.

    If the folder from before is gone, which a server may outlive, the process stays in this one.
    """
    before = folder
    with contextlib.suppress(OSError):
        before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            os.chdir(before)
