"""Replacing one of the user's files: whole at any moment, with the same permissions."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from idlc.disk.read import reason
from idlc.text import codes
from idlc.text.edits import apply

if TYPE_CHECKING:
    from idlc.text.diagnostics import Edit, Report


def replace(path: Path, name: str, data: bytes, report: Report) -> bool:
    """Give a file new content; report IDL612 and return `False` if that fails.

    A link stays one, and the file that it leads to is replaced.
    """
    target = path.resolve()
    try:
        handle, draft = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data)
            shutil.copymode(target, draft)
            Path(draft).replace(target)
        except BaseException:
            with contextlib.suppress(OSError):
                Path(draft).unlink()
            raise
    except OSError as error:
        report.add(codes.CANNOT_WRITE.of(name, f"cannot write `{name}`: {reason(error)}"))
        return False
    return True


def mend(edits: Iterable[Edit], report: Report) -> int:
    """Make edits in the files that they are for; return how many were made."""
    by_path: dict[str, list[Edit]] = {}
    for edit in edits:
        by_path.setdefault(edit.span.source.path, []).append(edit)
    done = 0
    for name, own in by_path.items():
        text, number = apply(own[0].span.source.text, own)
        if replace(Path(name), name, text.encode("utf-8"), report):
            done += number
    return done
