"""`idlc doctor`."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from idlc.cli import options

if TYPE_CHECKING:
    from idlc.diagnostics.report import Report
    from idlc.project.settings import Scope


@click.command("doctor", epilog=options.example("idlc doctor"))
@options.scoped(options.include, options.distro, despite_errors=True)
@options.style
def command(style: str, scope: Scope, report: Report) -> None:  # noqa: ARG001 - no problem of files
    """Check the installed programs, ROS 2 and packages.

    Each line begins with `ok` or `warn`, and a hint follows each warning. Attach the
    output of `--format json` to bug reports.
    """
    from idlc.cli import output
    from idlc.diagnostics.text import one_line
    from idlc.tasks.doctor import examine

    paint = output.painter(sys.stdout)
    for finding in examine(scope, output.program):
        subject, text, hint = finding
        if style == "json":
            output.fact(sys.stdout, subject, good=not hint, text=text, hint=hint)
        else:
            sign = "warn" if hint else "ok"
            head = paint("warning" if hint else "good", f"{sign:4}")
            sys.stdout.write(f"{head}  {subject:10}  {one_line(text)}\n")
            if hint:
                sys.stdout.write(f"{'':18}= {paint('hint', 'hint')}: {one_line(hint)}\n")
