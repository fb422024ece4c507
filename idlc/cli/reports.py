"""Writing a report in one of the formats."""

from __future__ import annotations

from typing import TYPE_CHECKING, TextIO

from idlc.cli import output
from idlc.diagnostics.report import Report
from idlc.diagnostics.terminal import MANY, counted, statistics, summary
from idlc.version import __version__

if TYPE_CHECKING:
    from idlc.check.run import Checked


def write(
    report: Report,
    style: str,
    checked: Checked,
    stream: TextIO,
    *,
    command: str = "check",
    numbers: bool = False,
    strict: bool = False,
) -> None:
    """Write a report on checked files; formats for machines are one whole document.

    With `numbers`, the text has the number of problems by code instead of each; with `strict`,
    warnings fail as errors do.
    """
    files, fixed = checked.files, checked.fixed
    match style:
        case "text":
            if not numbers:
                output.show(report, style, stream)
            if numbers or len(report) > MANY:
                stream.writelines(statistics(report))
            done = f"{counted(fixed, 'problem')} fixed, " if fixed else ""
            what = counted(len(files), "file")
            if not files and checked.packages:
                what = f"{counted(checked.packages, 'package')} without interfaces"
            which = f" for {', '.join(checked.distros)}" if checked.distros else ""
            rest = summary(report) if len(report) else f"no problems in {what}{which}"
            stream.write(f"{done}{rest}\n")
        case "json":
            output.show(report, style, stream)
            facts: dict[str, object] = {"files": len(files), **({"fixed": fixed} if fixed else {})}
            facts |= {"distros": list(checked.distros)} if checked.distros else {}
            output.fact(stream, "summary", **output.counts(report), **facts)
        case _:
            from idlc.diagnostics.formats import DOCUMENTS, Run

            stream.write(DOCUMENTS[style](report, Run(command, __version__, files, strict)))
