"""Replacing one of the user's files: whole at any moment, with the same permissions."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from idlc.diagnostics import codes
from idlc.diagnostics.edits import apply
from idlc.disk.output.whole_files import replace as replace_file
from idlc.disk.read import reason

if TYPE_CHECKING:
    from idlc.diagnostics.report import Edit, Report


def replace(path: Path, name: str, old: str, new: str, report: Report) -> bool:
    """Give a file new content; report IDL612 and return `False` if that fails.

    A link stays one, and the file that it leads to is replaced. What somebody else made of the
    file since it was read stays.
    """
    target = path.resolve()
    try:
        if target.read_bytes() != old.encode("utf-8"):
            message = f"`{name}` was changed while idlc was running"
            report.add(codes.CANNOT_WRITE.of(name, message, hint="run it again"))
            return False
        handle, draft = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(new.encode("utf-8"))
            shutil.copymode(target, draft)
            replace_file(draft, str(target))
        except BaseException:
            with contextlib.suppress(OSError):
                Path(draft).unlink()
            raise
    except OSError as error:
        report.add(codes.CANNOT_WRITE.of(name, f"cannot write `{name}`: {reason(error)}"))
        return False
    return True


def edit(edits: Iterable[Edit], report: Report, tidied: Callable[[str, str, str], str]) -> int:
    """Make edits in the files that they are for; return how many were made.

    `tidied` returns what to write, of a file's name, its text and the text after the edits.
    """
    by_path: dict[str, list[Edit]] = {}
    for edit in edits:
        by_path.setdefault(edit.span.source.path, []).append(edit)
    done = 0
    for name, own in by_path.items():
        old = own[0].span.source.text
        text, number = apply(old, own)
        if replace(Path(name), name, old, tidied(name, old, text), report):
            done += number
    return done
