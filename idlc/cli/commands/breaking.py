"""`idlc breaking`."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from idlc.cli import options

if TYPE_CHECKING:
    from idlc.diagnostics.report import Report
    from idlc.driver.breaking import Verdict
    from idlc.driver.graph import GraphVerdict

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
GRAPH = "graph"
PATIENCE = 5.0


@click.command("breaking", epilog=EPILOG)
@click.argument("paths", metavar="[PATH]...", nargs=-1, type=click.Path())
@click.option(
    "--against",
    metavar="DIR|git:REF|idlc.lock|distro:NAME|graph",
    help="The version to compare with: a folder, a git revision, the type hashes in a lock, the "
    "standard interfaces of a distribution, or what the nodes of the running ROS 2 graph use "
    "(a folder of that name is ./graph).",
)
@click.option(
    "--timeout",
    metavar="SECONDS",
    type=click.FloatRange(min=0, min_open=True),
    help="How long to wait for news from the graph, and for its nodes' answers.  [default: 5]",
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
@options.distro
@options.report_style
def command(
    paths: tuple[str, ...],
    against: str | None,
    timeout: float | None,
    levels: tuple[str, ...],
    package: str | None,
    include: tuple[str, ...],
    exclude: tuple[str, ...],
    distro: str | None,
    style: str,
) -> int:
    """Report what a new version of interfaces breaks, and for whom.

    wire: bytes recorded before are read wrongly or not at all. hash: endpoints of both versions
    do not talk. source: code fails. behaviour: the same code does something else.

    With distro:NAME, the standard interfaces that PATH uses are compared with that
    distribution's, or all of them if there is no PATH.

    Against the graph, it reports the types of which running nodes have several versions, or
    another one than the files here or the installed packages.
    """
    from idlc.cli import output
    from idlc.diagnostics.report import Report
    from idlc.disk import command_settings, pyproject
    from idlc.disk.scope import scope
    from idlc.driver.breaking import BreakingOptions, breaking
    from idlc.driver.breaking_distro import is_distro

    report = Report()
    settings = pyproject.load(report)
    against = against or command_settings.against(settings, report)
    allowed = command_settings.allowances(settings, report)
    if against is None and not report.had_errors:
        raise click.UsageError("give --against DIR, git:REF, idlc.lock, distro:NAME or graph")
    if timeout is not None and against != GRAPH:
        raise click.UsageError("--timeout is for --against graph")
    verdict: Verdict | GraphVerdict | None = None
    if against is not None and not report.had_errors:
        wanted = BreakingOptions(
            paths=paths or settings.paths or (() if is_distro(against) else (".",)),
            against=against,
            scope=scope(settings, package, include, exclude, distro),
            levels=levels or LEVELS,
            allowed=allowed,
            allowed_in=settings.source.path if settings.source else "",
            today=_today(),
        )
        if against == GRAPH:
            from idlc.driver.graph import compare_with_graph

            patience = timeout or PATIENCE
            verdict = compare_with_graph(wanted, patience, report, is_given=bool(paths))
        else:
            verdict = breaking(wanted, report)
    _show(report, verdict, style)
    return output.status(report)


def _today() -> str:
    import datetime

    return datetime.datetime.now().astimezone().date().isoformat()


def _show(report: Report, verdict: Verdict | GraphVerdict | None, style: str) -> None:
    from idlc.cli import output, reports
    from idlc.diagnostics.formats.github import notice
    from idlc.driver.check import Checked

    if style == "json":
        output.show(report, style, sys.stdout)
        facts = verdict._asdict() if verdict else {}
        for endpoint in facts.pop("endpoints", ()):
            output.fact(sys.stdout, "endpoint", **endpoint._asdict())
        output.fact(sys.stdout, "summary", **output.counts(report), **facts)
    elif style == "text":
        output.show(report, style, sys.stdout)
        if verdict:
            sys.stdout.write(f"{_summary(verdict)}\n")
    else:
        reports.write(report, style, Checked(()), sys.stdout, command="breaking")
        if style == "github" and verdict:
            sys.stdout.write(notice("idlc breaking", _summary(verdict)))


def _summary(verdict: Verdict | GraphVerdict) -> str:
    from idlc.driver.breaking import Verdict

    parts = [f"{number} {level}" for level, number in verdict.levels.items() if number]
    text = f"breaks: {', '.join(parts)}" if parts else "nothing breaks"
    if verdict.allowed:
        text += f"; allowed: {verdict.allowed}"
    return text + (_next(verdict) if isinstance(verdict, Verdict) else _seen(verdict))


def _seen(verdict: GraphVerdict) -> str:
    """Return what was looked at."""
    from idlc.diagnostics.formats.terminal import counted

    seen = [counted(number, noun) for noun, number in verdict.seen.items()]
    text = f"; looked at {', '.join(seen)}"
    return f"{text}; without type hash: {verdict.silent}" if verdict.silent else text


def _next(verdict: Verdict) -> str:
    """Return what was added, and which version comes next."""
    from idlc.diagnostics.report import first_few

    text = f"; added: {first_few(verdict.added, 5)}" if verdict.added else ""
    if verdict.part is None:
        same = not (any(verdict.levels.values()) or verdict.allowed or verdict.added)
        return f"{text}; the versions are the same" if same else text
    if verdict.next_version:
        return f"{text}; the next version after {verdict.version} is {verdict.next_version}"
    return f"{text}; raise the {verdict.part} version"
