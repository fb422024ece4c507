"""Folders that take long to make: one worker of a run makes them for all."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from idlc.project.atomic import exclusive


def shared_folder(
    factory: pytest.TempPathFactory, name: str, make: Callable[[Path], object]
) -> Path:
    """Return a folder of this run; the first worker that asks for it calls `make` with its path."""
    base = factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        base = base.parent
    folder, draft = base / name / "whole", base / name / "draft"
    with exclusive(folder):
        if not folder.exists():
            make(draft)
            draft.rename(folder)
    return folder
