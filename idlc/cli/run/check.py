"""`idlc check`, free of click."""

from __future__ import annotations

import sys
from contextlib import suppress

from idlc.check.select import selection
from idlc.cli import output
from idlc.diagnostics import terminal
from idlc.diagnostics.report import Report, ReportedError, Severity
from idlc.diagnostics.terminal import counted
from idlc.diagnostics.text import one_line
from idlc.project.settings import scope, settings_here
from idlc.tasks.check import CheckOptions, CheckResult, check


def check_paths(
    paths: tuple[str, ...],
    *,
    select: str | None = None,
    ignore: str | None = None,
    fix: bool = False,
    diff: bool = False,
    strict: bool = False,
    style: str = "text",
    prefix: str | None = None,
    package: str | None = None,
    include: tuple[str, ...] = (),
    exclude: tuple[str, ...] = (),
    distro: str | None = None,
) -> int:
    """Check paths, or those in pyproject.toml, or the working folder; return the exit status.

    `select` and `ignore` are lists of rules with commas.
    """
    settings, report = settings_here()
    chosen = selection(settings, report).with_lists(select, ignore)
    checked = CheckResult(())
    if prefix is not None:
        from idlc.tasks.check_prefix import check_prefix

        checked = check_prefix(prefix, settings.root, report)
    else:
        with suppress(ReportedError):
            report.raise_errors()  # of the settings
            where = scope(settings, package, include, exclude, distro)
            options = CheckOptions(paths or settings.paths or (".",), where, chosen, fix, diff)
            checked = check(options, report)
    if style == "text":
        _show(checked, report, diff=diff)
    elif style == "json":
        output.show(report, style, sys.stdout)
        facts: dict[str, object] = {"files": len(checked.files)}
        if checked.fixed:
            facts["fixed"] = checked.fixed
        if checked.distros:
            facts["distros"] = list(checked.distros)
        output.fact(sys.stdout, "summary", **output.counts(report), **facts)
    else:
        output.document(report, style, "check", checked.files, strict=strict)
    is_refused = (strict and len(report) > 0) or (diff and checked.fixed > 0)
    return output.status(report) or int(is_refused)


def check_file(path: str, *, strict: bool) -> tuple[list[str], list[str]]:
    """Return the errors in a file as text, and a line for each warning; none if `strict`."""
    settings, report = settings_here()
    chosen = selection(settings, report)
    with suppress(ReportedError):
        report.raise_errors()
        check(CheckOptions((path,), scope(settings), chosen), report)
    errors = [problem for problem in report if strict or problem.severity is Severity.ERROR]
    others = [problem for problem in report if problem not in errors]
    lines = [f"{problem.where[0]}: {problem.code}: {problem.message}" for problem in others]
    return list(terminal.text(errors)), lines


def _show(checked: CheckResult, report: Report, *, diff: bool) -> None:
    """Print problems and a summary; a diff goes to standard output alone, so it can be applied."""
    stream = sys.stderr if diff else sys.stdout
    paint = output.painter(stream)
    if diff:
        for name, (old, new) in checked.texts.items():
            output.diff(name, old, new, sys.stdout)
    output.show(report, "text", stream, fixable=True)
    if len(report) > terminal.MANY:
        stream.writelines(terminal.statistics(report))
    if checked.fixed:
        stream.write(f"{checked.fixed} {'would be fixed' if diff else 'fixed'}, ")
    if len(report):
        stream.write(f"{terminal.summary(report)}\n")
    else:
        subject = counted(len(checked.files), "file")
        if not checked.files and checked.packages:
            subject = f"{counted(checked.packages, 'package')} without interfaces"
        distros = f" for {', '.join(checked.distros)}" if checked.distros else ""
        stream.write(f"{paint('good', f'no problems in {subject}{distros}')}\n")
    if fixable := sum(bool(problem.edits) for problem in report):
        star = paint("hint", "[*]")
        stream.write(f"{star} {counted(fixable, 'problem')} fixable with `--fix`\n")
    sys.stderr.writelines(f"note: {one_line(note)}\n" for note in checked.notes)
