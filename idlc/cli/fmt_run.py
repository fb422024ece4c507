"""The body of `idlc fmt`, free of click."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from typing import TextIO

from idlc.cli import output
from idlc.diagnostics.formats.terminal import counted
from idlc.diagnostics.report import Report
from idlc.diagnostics.visible import one_line, visible
from idlc.disk.scope import scope
from idlc.disk.settings import pyproject
from idlc.driver.fmt import Formatted, fmt


def run(paths: tuple[str, ...], exclude: tuple[str, ...], *, write: bool, diff: bool) -> int:
    """Format files, or show what would change, and return the exit status."""
    report = Report()
    settings = pyproject.load(report)
    files: list[Formatted] = []
    done = "changed" if write else "would change"
    if not report.had_errors:
        left_out = scope(settings, exclude=exclude).exclude
        for file in fmt(paths or settings.paths or (".",), left_out, report, write=write):
            files.append(file)
            if file.changed and diff:
                sys.stdout.writelines(_diff(file, sys.stdout))
            elif file.changed:
                sys.stdout.write(f"{done} {one_line(file.path)}\n")
    output.show(report, "text", sys.stderr)
    if files:
        (sys.stderr if diff else sys.stdout).write(f"{_summary(files, done)}\n")
    return output.status(report) or int(not write and any(file.changed for file in files))


def _summary(files: Sequence[Formatted], done: str) -> str:
    changed = sum(file.changed for file in files)
    broken = sum(file.old is None for file in files)
    numbers = {
        done: changed,
        "with errors left alone": broken,
        "already formatted": len(files) - changed - broken,
    }
    return ", ".join(f"{counted(count, 'file')} {what}" for what, count in numbers.items() if count)


def _diff(file: Formatted, stream: TextIO) -> Iterator[str]:
    """Yield a unified diff: for a program as it is, for a terminal without what would harm it."""
    from difflib import unified_diff

    old = (file.old or "").splitlines(keepends=True)
    new = (file.new or "").splitlines(keepends=True)
    path = one_line(file.path)
    codes = {"+": "32", "-": "31", "@": "36"} if output.colours(stream) else {}
    for line in unified_diff(old, new, f"a/{path}", f"b/{path}"):
        text = line.rstrip("\r\n")
        shown = visible(text) if stream.isatty() else text
        code = codes.get(line[:1])
        yield f"\x1b[{code}m{shown}\x1b[0m\n" if code else f"{shown}\n"
        if not line.endswith(("\n", "\r")):
            yield "\\ No newline at end of file\n"
