"""Showing reports to people and to programs, and the exit status that goes with them."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import TextIO

from idlc.diagnostics import codes
from idlc.diagnostics.formats import terminal
from idlc.diagnostics.report import Report, Severity
from idlc.diagnostics.visible import one_line, visible


def colours(stream: TextIO) -> bool:
    """Return whether to colour a stream: if it is a terminal, unless the user says otherwise."""
    if os.environ.get("NO_COLOR"):
        return False
    if os.environ.get("FORCE_COLOR"):
        return True
    return stream.isatty() and os.environ.get("TERM") != "dumb"


def show(report: Report, style: str, stream: TextIO) -> None:
    """Write every problem to a stream, as text or as JSON lines."""
    blocks = terminal.json_lines(report) if style == "json" else _spaced(report, stream)
    stream.writelines(blocks)


def _spaced(report: Report, stream: TextIO) -> list[str]:
    return [f"{block}\n" for block in terminal.text(report, colour=colours(stream))]


def notes(report: Report, stream: TextIO) -> None:
    """Write what is worth knowing and no problem."""
    stream.writelines(f"note: {one_line(note)}\n" for note in dict.fromkeys(report.notes))


def fact(stream: TextIO, kind: str, **facts: object) -> None:
    """Write a JSON line that is not a problem."""
    import json

    stream.write(json.dumps({"type": kind, **facts}) + "\n")


def texts(found: Iterable[str], style: str, stream: TextIO) -> None:
    """Write interfaces, one after the other."""
    text = "\n".join(found)
    if style == "text" or stream.isatty():  # other formats are for other tools
        text = "\n".join(map(visible, text.split("\n")))
    stream.write(text)


def counts(report: Report) -> dict[str, int]:
    """Return the number of errors and warnings."""
    errors = sum(found.severity is Severity.ERROR for found in report)
    return {"errors": errors, "warnings": len(report) - errors}


def status(report: Report) -> int:
    """Return the exit status: 0 clean, 1 findings, 2 usage or configuration."""
    errors = [found for found in report if found.severity is Severity.ERROR]
    if any(found.code in codes.USAGE for found in errors):
        return 2
    return 1 if errors else 0
