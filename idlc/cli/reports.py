"""A report in the format that was asked for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TextIO

from idlc import __version__
from idlc.cli import terminal
from idlc.text.diagnostics import Report
from idlc.text.present import counted, summary


def write(
    report: Report,
    style: str,
    files: Sequence[str],
    fixed: int,
    stream: TextIO,
    *,
    command: str = "check",
) -> None:
    """Write a report on files that were looked at; formats for machines are one whole document."""
    match style:
        case "text":
            terminal.show(report, style, stream)
            mended = f"{counted(fixed, 'problem')} mended, " if fixed else ""
            rest = (
                summary(report) if len(report) else f"no problems in {counted(len(files), 'file')}"
            )
            stream.write(f"{mended}{rest}\n")
        case "json":
            terminal.show(report, style, stream)
            facts = {"files": len(files), **({"fixed": fixed} if fixed else {})}
            terminal.fact(stream, "summary", **terminal.counts(report), **facts)
        case "github":
            from idlc.text import github

            stream.writelines(github.lines(report))
        case "sarif":
            from idlc.text import sarif

            stream.write(sarif.document(report, __version__, command))
        case "junit":
            from idlc.text import junit

            stream.write(junit.document(report, files))
        case "gitlab":
            from idlc.text import gitlab

            stream.write(gitlab.document(report))
