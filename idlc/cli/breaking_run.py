"""What `idlc breaking` does, without the reading of its options."""

from __future__ import annotations

import datetime
import sys

import click
import msgspec

from idlc.cli import output, reports
from idlc.diagnostics.report import Report, first_few
from idlc.disk import command_settings, pyproject
from idlc.disk.scope import scope
from idlc.driver.breaking import BreakingOptions, Verdict, breaking
from idlc.driver.check import Checked


class BreakingWishes(msgspec.Struct, frozen=True):
    """What was typed."""

    paths: tuple[str, ...]
    against: str | None
    levels: tuple[str, ...]
    package: str | None
    include: tuple[str, ...]
    exclude: tuple[str, ...]
    style: str


def compare(typed: BreakingWishes) -> int:
    """Compare versions, show what breaks and return the exit status."""
    report = Report()
    settings = pyproject.load(report)
    against = typed.against or command_settings.against(settings, report)
    allowed = command_settings.allowances(settings, report)
    verdict = None
    if not report.had_errors:
        if against is None:
            raise click.UsageError("give --against DIR, git:REF or idlc.lock")
        wanted = BreakingOptions(
            paths=typed.paths or settings.paths or (".",),
            against=against,
            scope=scope(settings, typed.package, typed.include, typed.exclude),
            levels=typed.levels,
            allowed=allowed,
            allowed_in=settings.source.path if settings.source else "",
            today=datetime.datetime.now().astimezone().date().isoformat(),
        )
        verdict = breaking(wanted, report)
    _show(report, verdict, typed.style)
    return output.status(report)


def _show(report: Report, verdict: Verdict | None, style: str) -> None:
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
            from idlc.diagnostics.formats.github import notice

            sys.stdout.write(notice("idlc breaking", _summary(verdict)))


def _summary(verdict: Verdict) -> str:
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
