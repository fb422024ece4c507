"""`idlc fmt`."""

from __future__ import annotations

import click

from idlc.cli import options

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

    Nothing else changes, so the meaning stays. Files with syntax errors are left alone. PATH is as
    for `idlc check`.
    """
    from idlc.cli.fmt_run import run

    return run(paths, exclude, write=not (check or diff), diff=diff)
