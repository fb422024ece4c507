"""`idlc fmt`."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from idlc.cli import options

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import TextIO

    from idlc.driver.fmt import Formatted

EPILOG = """\
Example:

\b
  mkdir -p demo/msg
  echo 'float64   speed 0.5# [m/s]' > demo/msg/Drive.msg
  idlc fmt demo
"""


@click.command("fmt", epilog=EPILOG)
@click.argument("paths", metavar="[PATH]...", nargs=-1, type=click.Path())
@click.option("--check", is_flag=True, help="Write nothing; fail if a file would change.")
@click.option("--diff", is_flag=True, help="Write nothing; show what would change, and fail if so.")
@options.exclude
def command(paths: tuple[str, ...], check: bool, diff: bool, exclude: tuple[str, ...]) -> int:
    """Tidy the blanks of interface files, and leave alone what was laid out with care.

    A gap between words stays if it is one blank (or two before a comment), if it puts a word in one
    column with another of its kind, or if the whole block has the same gap. A stray word moves
    into the column of its neighbours, or else next to the word before it. `=` has blanks on both
    sides or on none. There are at most two blank lines in a row. A file that is changed also loses
    the blanks at the ends of its lines; these alone, or a missing line end, change no file.

    Nothing else changes, so the meaning stays. Files with errors are left alone. PATH is as for
    `idlc check`.
    """
    from idlc.cli import output
    from idlc.diagnostics.formats.terminal import counted
    from idlc.diagnostics.report import Report
    from idlc.diagnostics.visible import one_line
    from idlc.disk import pyproject
    from idlc.disk.scope import scope
    from idlc.driver.fmt import fmt

    report = Report()
    settings = pyproject.load(report)
    dry = check or diff
    files: list[Formatted] = []
    if not report.had_errors:
        left_out = scope(settings, exclude=exclude).exclude
        for file in fmt(paths or settings.paths or (".",), left_out, report, write=not dry):
            files.append(file)
            if file.changed and diff:
                sys.stdout.writelines(_diff(file, sys.stdout))
            elif file.changed:
                sys.stdout.write(f"{'would change' if dry else 'changed'} {one_line(file.path)}\n")
    output.show(report, "text", sys.stderr)
    changed = sum(file.changed for file in files)
    broken = sum(file.old is None for file in files)
    parts = [f"{counted(changed, 'file')} {'would change' if dry else 'changed'}"] * bool(changed)
    parts += [f"{counted(broken, 'file')} with errors left alone"] * bool(broken)
    rest = len(files) - changed - broken
    parts += [f"{counted(rest, 'file')} in order"] * bool(rest)
    if parts:
        (sys.stderr if diff else sys.stdout).write(", ".join(parts) + "\n")
    return output.status(report) or int(dry and bool(changed))


def _diff(file: Formatted, stream: TextIO) -> Iterator[str]:
    """Yield a unified diff: for a program as it is, for a terminal without what would harm it."""
    from difflib import unified_diff

    from idlc.cli import output
    from idlc.diagnostics.visible import one_line, visible

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
