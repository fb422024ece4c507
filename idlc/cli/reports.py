"""A report in the format that was asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, TextIO

from idlc import __version__
from idlc.cli import terminal
from idlc.text.diagnostics import Report
from idlc.text.present import MANY, counted, statistics, summary

if TYPE_CHECKING:
    from idlc.driver.check import Checked


def write(
    report: Report,
    style: str,
    checked: Checked,
    stream: TextIO,
    *,
    command: str = "check",
    numbers: bool = False,
) -> None:
    """Write a report on what was looked at; formats for machines are one whole document.

    `numbers` leaves out of the text what was found, and only says how often.
    """
    files, fixed = checked.files, checked.fixed
    match style:
        case "text":
            if not numbers:
                terminal.show(report, style, stream)
            if numbers or len(report) > MANY:
                stream.writelines(statistics(report))
            done = f"{counted(fixed, 'problem')} fixed, " if fixed else ""
            what = counted(len(files), "file")
            if not files and checked.packages:
                what = f"{counted(checked.packages, 'package')} without interfaces"
            rest = summary(report) if len(report) else f"no problems in {what}"
            stream.write(f"{done}{rest}\n")
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
