"""`idlc fmt`."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple, TextIO

import click

from idlc.cli import options

if TYPE_CHECKING:
    from idlc.diagnostics.report import Report
    from idlc.diagnostics.source import Source
    from idlc.project.find import Exclusions, InterfaceFile
    from idlc.project.root import Root


class FormattedFile(NamedTuple):
    """A file before and after; both are `None` if its syntax errors forbid a layout."""

    path: str
    old: str | None = None
    new: str | None = None

    @property
    def changed(self) -> bool:
        """True if its layout is not the canonical one."""
        return self.old != self.new


def fmt(
    paths: Sequence[str], root: Root, exclude: Exclusions, report: Report, *, write: bool
) -> Iterator[FormattedFile]:
    """Yield each file that paths mean, laid out; with `write`, after writing it.

    Files with syntax errors are reported and left alone.
    """
    from idlc.check.compiler import stage
    from idlc.project.files import read_source
    from idlc.project.find import find
    from idlc.project.write import rewrite

    for file in find(paths, root, report, exclude):
        source = read_source(file.path, file.shown, report)
        if source is None:
            continue
        with stage("format", file.shown):
            formatted = _format(file, source, report)
        if write and formatted.changed and formatted.new is not None:
            rewrite(file.path, file.shown, source.text, formatted.new, report)
        yield formatted


def _format(file: InterfaceFile, source: Source, report: Report) -> FormattedFile:
    from idlc.check.format import laid_out
    from idlc.model import ir

    new = laid_out(source, ir.TypeName("package", file.kind, file.name), report)
    return FormattedFile(file.shown) if new is None else FormattedFile(file.shown, source.text, new)


def run(paths: tuple[str, ...], exclude: tuple[str, ...], *, write: bool, diff: bool) -> int:
    """Format files, or show what would change, and return the exit status."""
    from idlc.cli import output
    from idlc.diagnostics.report import Report
    from idlc.diagnostics.text import one_line
    from idlc.project.root import Root
    from idlc.project.settings import load_settings, scope

    report = Report()
    settings = load_settings(Root.here(), report)
    files: list[FormattedFile] = []
    done = "changed" if write else "would change"
    if not report.had_errors:
        left_out = scope(settings, exclude=exclude).exclude
        for file in fmt(
            paths or settings.paths or (".",), settings.root, left_out, report, write=write
        ):
            files.append(file)
            if file.changed and diff:
                sys.stdout.writelines(_diff(file, sys.stdout))
            elif file.changed:
                sys.stdout.write(f"{done} {one_line(file.path)}\n")
    output.show(report, "text", sys.stderr)
    if files:
        (sys.stderr if diff else sys.stdout).write(f"{_summary(files, done)}\n")
    return output.status(report) or int(not write and any(file.changed for file in files))


def _summary(files: Sequence[FormattedFile], done: str) -> str:
    from idlc.diagnostics.terminal import counted

    changed = sum(file.changed for file in files)
    broken = sum(file.old is None for file in files)
    numbers = {
        done: changed,
        "with errors left alone": broken,
        "already formatted": len(files) - changed - broken,
    }
    return ", ".join(f"{counted(count, 'file')} {what}" for what, count in numbers.items() if count)


def _diff(file: FormattedFile, stream: TextIO) -> Iterator[str]:
    """Yield a unified diff: for a program as it is, for a terminal without control characters."""
    from difflib import unified_diff

    from idlc.cli import output
    from idlc.diagnostics.text import one_line, visible

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
    return run(paths, exclude, write=not (check or diff), diff=diff)
