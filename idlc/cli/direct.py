"""The body of `idlc check`, free of click."""

from __future__ import annotations

import sys
from typing import NamedTuple


class CheckArguments(NamedTuple):
    """The arguments besides paths; `select` and `ignore` are lists of rules with commas."""

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


def check_paths(paths: tuple[str, ...], arguments: CheckArguments | None = None) -> int:
    """Check paths, or those in pyproject.toml, or the working folder; return the exit status."""
    from idlc.check.run import CheckOptions, CheckResult, check
    from idlc.check.select import selection
    from idlc.cli import output
    from idlc.diagnostics.report import Report
    from idlc.project.root import Root
    from idlc.project.settings import load_settings, scope

    arguments = arguments or CheckArguments()
    report = Report()
    settings = load_settings(Root.here(), report)
    configured = selection(settings, report)
    chosen = configured.with_lists(arguments.select, arguments.ignore)
    checked = CheckResult(())
    if arguments.prefix is not None:
        from idlc.check.prefix import check_prefix

        checked = check_prefix(arguments.prefix, settings.root, report)
    elif not report.had_errors:
        where = scope(
            settings,
            arguments.package,
            arguments.include,
            arguments.exclude,
            arguments.distro,
        )
        options = CheckOptions(
            paths=paths or settings.paths or (".",),
            scope=where,
            selection=chosen,
            fix=arguments.fix,
        )
        checked = check(options, report)
    numbers, strict = arguments.statistics, arguments.strict
    output.write_report(
        report, arguments.style, checked, sys.stdout, numbers=numbers, strict=strict
    )
    return output.status(report) or int(arguments.strict and bool(len(report)))


def serve_editor() -> int:
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
