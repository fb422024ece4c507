"""Replacing one of the user's files: whole at any moment, with the same permissions."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from idlc.disk.read import reason
from idlc.text import codes

if TYPE_CHECKING:
    from idlc.text.diagnostics import Report


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
