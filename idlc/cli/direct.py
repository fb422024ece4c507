"""The body of `idlc check`, free of click."""

from __future__ import annotations

import sys

import msgspec

from idlc.check import select
from idlc.check.run import Checked, CheckOptions, check
from idlc.cli import output, reports
from idlc.diagnostics.report import Report
from idlc.project.root import Root
from idlc.project.settings import load_settings, scope


class Wishes(msgspec.Struct, frozen=True):
    """What was typed besides paths; `select` and `ignore` are lists of rules with commas."""

    select: str | None = None
    ignore: str | None = None
    fix: bool = False
    strict: bool = False
    package: str | None = None
    include: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    style: str = "text"
    statistics: bool = False
    prefix: str | None = None
    distro: str | None = None


def check_paths(paths: tuple[str, ...], wishes: Wishes | None = None) -> int:
    """Check what paths mean, or pyproject.toml, or the working folder; return the exit status."""
    wishes = wishes or Wishes()
    report = Report()
    settings = load_settings(Root.here(), report)
    configured = select.selection(settings, report)
    chosen = configured.with_lists(wishes.select, wishes.ignore)
    checked = Checked(())
    if wishes.prefix is not None:
        from idlc.check.prefix import check_prefix

        checked = check_prefix(wishes.prefix, settings.root, report)
    elif not report.had_errors:
        wanted = CheckOptions(
            paths=paths or settings.paths or (".",),
            scope=scope(settings, wishes.package, wishes.include, wishes.exclude, wishes.distro),
            selection=chosen,
            fix=wishes.fix,
        )
        checked = check(wanted, report)
    numbers, strict = wishes.statistics, wishes.strict
    reports.write(report, wishes.style, checked, sys.stdout, numbers=numbers, strict=strict)
    return output.status(report) or int(wishes.strict and bool(len(report)))


def run() -> int:
    """Serve the client at the other end of standard input and output; return the exit status."""
    from idlc.editor.server import serve

    if sys.stdin.isatty():
        sys.stderr.write("an editor starts this, and talks to it; Ctrl-C ends it\n")
    # a thread may still read when the program ends, so it is not sys.stdin that it waits in, and
    # what it waits in is never closed
    reader = open(sys.stdin.fileno(), "rb", closefd=False)  # noqa: SIM115
    # nor does anything stay in sys.stdout that cannot be written when the program ends
    writer = open(sys.stdout.fileno(), "wb", closefd=False)  # noqa: SIM115
    return serve(reader, writer)
