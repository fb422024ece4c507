"""`idlc fmt`."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import TextIO

import click

from idlc.cli import options


def _diff(path: str, old: str, new: str, stream: TextIO) -> Iterator[str]:
    """Yield a unified diff: for a program as it is, for a terminal without control characters."""
    from difflib import unified_diff

    from idlc.cli import output
    from idlc.diagnostics.text import one_line, visible

    path = one_line(path)
    before, after = old.splitlines(keepends=True), new.splitlines(keepends=True)
    codes = {"+": "32", "-": "31", "@": "36"} if output.colours(stream) else {}
    for line in unified_diff(before, after, f"a/{path}", f"b/{path}"):
        text = line.rstrip("\r\n")
        shown = visible(text) if stream.isatty() else text
        code = codes.get(line[:1])
        yield f"\x1b[{code}m{shown}\x1b[0m\n" if code else f"{shown}\n"
        if not line.endswith(("\n", "\r")):
            yield "\\ No newline at end of file\n"


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
    from idlc.check.compiler import stage
    from idlc.check.format import laid_out
    from idlc.cli import output
    from idlc.diagnostics.terminal import counted
    from idlc.diagnostics.text import one_line
    from idlc.model import ir
    from idlc.project.files import read_source
    from idlc.project.find import find
    from idlc.project.settings import scope, settings_here
    from idlc.project.write import rewrite

    settings, report = settings_here()
    write = not (check or diff)
    done = "changed" if write else "would change"
    broken, clean = "with errors left alone", "already formatted"
    numbers = dict.fromkeys((done, broken, clean), 0)
    if not report.had_errors:
        left_out = scope(settings, exclude=exclude).exclude
        for file in find(paths or settings.paths or (".",), settings.root, report, left_out):
            source = read_source(file.path, file.shown, report)
            if source is None:
                continue
            with stage("format", file.shown):
                name = ir.TypeName("package", file.kind, file.name)
                new = laid_out(source, name, report)
            if new is None or new == source.text:
                numbers[broken if new is None else clean] += 1
                continue
            numbers[done] += 1
            if write:
                rewrite(file.path, file.shown, source.text, new, report)
            if diff:
                sys.stdout.writelines(_diff(file.shown, source.text, new, sys.stdout))
            else:
                sys.stdout.write(f"{done} {one_line(file.shown)}\n")
    output.show(report, "text", sys.stderr)
    shown = [f"{counted(count, 'file')} {what}" for what, count in numbers.items() if count]
    if shown:
        (sys.stderr if diff else sys.stdout).write(f"{', '.join(shown)}\n")
    return output.status(report) or int(not write and bool(numbers[done]))
