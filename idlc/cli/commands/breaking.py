"""`idlc breaking`."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from idlc.cli import options

if TYPE_CHECKING:
    from idlc.diagnostics.report import Report
    from idlc.driver.breaking import Verdict

EPILOG = """\
Example:

\b
  mkdir -p old/msg new/msg
  echo 'float64 speed 0.5  # [m/s]' > old/msg/Drive.msg
  echo 'float64 speed 0.7  # [m/s]' > new/msg/Drive.msg
  idlc breaking new --against old --level hash

A change that is meant is allowed in pyproject.toml, with a reason and for a time:

\b
  [[tool.idlc.breaking.allow]]
  at = "demo/msg/Drive.speed"
  reason = "all robots are updated in the same week"
  until = 2030-12-31
"""

LEVELS = ("wire", "hash", "source", "behaviour")


@click.command("breaking", epilog=EPILOG)
@click.argument("paths", metavar="[PATH]...", nargs=-1, type=click.Path())
@click.option(
    "--against",
    metavar="DIR|git:REF|idlc.lock",
    help="The version to compare with: a folder, a git revision, or the type hashes in a lock.",
)
@click.option(
    "--level",
    "levels",
    multiple=True,
    type=click.Choice(LEVELS),
    help="Only report what breaks this. May be repeated; otherwise all.",
)
@options.package
@options.include
@options.exclude
@options.report_style
def command(
    paths: tuple[str, ...],
    against: str | None,
    levels: tuple[str, ...],
    package: str | None,
    include: tuple[str, ...],
    exclude: tuple[str, ...],
    style: str,
) -> int:
    """Report what a new version of interfaces breaks, and for whom.

    wire: bytes recorded before are read wrongly or not at all. hash: endpoints of both versions
    do not talk. source: code fails. behaviour: the same code does something else.
    """
    import datetime

    from idlc.cli import output
    from idlc.diagnostics.report import Report
    from idlc.disk import command_settings, pyproject
    from idlc.disk.scope import scope
    from idlc.driver.breaking import BreakingOptions, breaking

    report = Report()
    settings = pyproject.load(report)
    against = against or command_settings.against(settings, report)
    allowed = command_settings.allowances(settings, report)
    if against is None and not report.had_errors:
        raise click.UsageError("give --against DIR, git:REF or idlc.lock")
    verdict = None
    if against is not None and not report.had_errors:
        wanted = BreakingOptions(
            paths=paths or settings.paths or (".",),
            against=against,
            scope=scope(settings, package, include, exclude),
            levels=levels or LEVELS,
            allowed=allowed,
            allowed_in=settings.source.path if settings.source else "",
            today=datetime.datetime.now().astimezone().date().isoformat(),
        )
        verdict = breaking(wanted, report)
    _show(report, verdict, style)
    return output.status(report)


def _show(report: Report, verdict: Verdict | None, style: str) -> None:
    from idlc.cli import output, reports
    from idlc.diagnostics.formats.github import notice
    from idlc.driver.check import Checked

    if style == "json":
        output.show(report, style, sys.stdout)
        facts = verdict._asdict() if verdict else {}
        output.fact(sys.stdout, "summary", **output.counts(report), **facts)
    elif style == "text":
        output.show(report, style, sys.stdout)
        if verdict:
            sys.stdout.write(f"{_summary(verdict)}\n")
    else:
        reports.write(report, style, Checked(()), sys.stdout, command="breaking")
        if style == "github" and verdict:
            sys.stdout.write(notice("idlc breaking", _summary(verdict)))


def _summary(verdict: Verdict) -> str:
    from idlc.diagnostics.report import first_few

    parts = [f"{number} {level}" for level, number in verdict.levels.items() if number]
    text = f"breaks: {', '.join(parts)}" if parts else "nothing breaks"
    if verdict.allowed:
        text += f"; allowed: {verdict.allowed}"
    if verdict.added:
        text += f"; added: {first_few(verdict.added, 5)}"
    if verdict.part is None:
        return f"{text}; the versions are the same"
    if verdict.next_version:
        return f"{text}; the next version after {verdict.version} is {verdict.next_version}"
    return f"{text}; raise the {verdict.part} version"
