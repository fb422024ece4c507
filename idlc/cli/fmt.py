"""`idlc fmt`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import options


@click.command(
    "fmt",
    epilog=options.example(
        "mkdir -p demo/msg",
        "echo 'float64   speed 0.5# [m/s]' > demo/msg/Drive.msg",
        "idlc fmt demo",
    ),
)
@click.argument("paths", metavar="[PATH]...", nargs=-1, type=click.Path())
@click.option("--check", is_flag=True, help="Write nothing; fail if a file would change.")
@click.option(
    "--diff", is_flag=True, help="Write nothing; show the changes and fail if there are any."
)
@options.exclude
def command(**arguments: Any) -> int:
    """Normalize whitespace and keep deliberate alignment.

    idlc keeps single spaces between words, and two spaces before a comment. It keeps wider gaps if
    they align words of the same kind, or if all lines of a block have them. Otherwise, it aligns
    the word with the lines above and below, or moves it next to the previous word. It puts spaces
    on both sides of `=` or on neither side, and keeps at most two consecutive empty lines. If idlc
    changes a file, it also removes trailing whitespace and adds a missing final newline.

    Formatting never changes the meaning of a file. idlc skips files with syntax errors. PATH works
    as in `idlc check`.
    """
    from idlc.cli.run.fmt import run

    return run(**arguments)
