"""`idlc breaking`."""

from __future__ import annotations

import datetime
import sys
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from idlc.cli import options

if TYPE_CHECKING:
    from idlc.compare.breaking import BreakingOptions, Verdict
    from idlc.compare.recording import RecordedVerdict
    from idlc.compare.running import GraphVerdict
    from idlc.diagnostics.report import Report
    from idlc.project.root import Root
GRAPH = "graph"
PATIENCE = 5.0


class BreakingArguments(NamedTuple):
    """The arguments of `idlc breaking`."""

    paths: tuple[str, ...]
    against: str | None
    timeout: float | None
    levels: tuple[str, ...]
    package: str | None
    include: tuple[str, ...]
    exclude: tuple[str, ...]
    distro: str | None
    style: str


def compare(typed: BreakingArguments) -> int:
    """Compare versions, show what breaks and return the exit status."""
    from idlc.cli import output
    from idlc.compare import packages
    from idlc.compare.breaking import BreakingOptions
    from idlc.compare.changes import LEVELS
    from idlc.compare.distribution import is_distro
    from idlc.diagnostics.report import Report
    from idlc.project.root import Root
    from idlc.project.settings import load_settings, scope

    report = Report()
    settings = load_settings(Root.here(), report)
    against = typed.against or packages.against(settings, report)
    allowed = packages.allowances(settings, report)
    if against is None and not report.had_errors:
        raise click.UsageError(
            "give --against DIR, git:REF, idlc.lock, a recording, distro:NAME or graph"
        )
    if typed.timeout is not None and against != GRAPH:
        raise click.UsageError("--timeout is for --against graph")
    verdict: Verdict | GraphVerdict | RecordedVerdict | None = None
    if against is not None and not report.had_errors:
        recordings, paths = _recordings(against, typed.paths, settings.root)
        needs_none = recordings or is_distro(against)
        comparison = BreakingOptions(
            paths=paths or settings.paths or (() if needs_none else (".",)),
            against=against,
            scope=scope(settings, typed.package, typed.include, typed.exclude, typed.distro),
            levels=typed.levels or (() if recordings else LEVELS),
            allowed=allowed,
            allowed_in=settings.source.path if settings.source else "",
            today=datetime.datetime.now().astimezone().date().isoformat(),
        )
        verdict = _compared(comparison, recordings, typed, report)
        if recordings:
            output.notes(report, sys.stderr)
    _show(report, verdict, typed)
    return output.status(report)


def _recordings(
    against: str, paths: tuple[str, ...], root: Root
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the recordings to compare with, and the paths that are none of them."""
    from idlc.compare.breaking import GIT
    from idlc.compare.distribution import is_distro

    if against == GRAPH or is_distro(against) or against.startswith(GIT):
        return (), paths
    from idlc.recordings.find import recordings_of

    return recordings_of(against, paths, root)


def _compared(
    comparison: BreakingOptions,
    recordings: tuple[str, ...],
    typed: BreakingArguments,
    report: Report,
) -> Verdict | GraphVerdict | RecordedVerdict | None:
    from idlc.compare.breaking import breaking

    if recordings:
        from idlc.compare.recording import compare_with_recordings

        return compare_with_recordings(comparison, recordings, report)
    if comparison.against != GRAPH:
        return breaking(comparison, report)
    from idlc.compare.running import compare_with_graph

    patience = typed.timeout or PATIENCE
    return compare_with_graph(comparison, patience, report, has_paths=bool(typed.paths))


def _show(
    report: Report,
    verdict: Verdict | GraphVerdict | RecordedVerdict | None,
    typed: BreakingArguments,
) -> None:
    from idlc.check.run import CheckResult
    from idlc.cli import output
    from idlc.diagnostics.formats import notice

    style = typed.style
    if style == "json":
        output.show(report, style, sys.stdout)
        facts = verdict._asdict() if verdict else {}
        for endpoint in facts.pop("endpoints", ()):
            output.fact(sys.stdout, "endpoint", **endpoint._asdict())
        output.fact(sys.stdout, "summary", **output.counts(report), **facts)
    elif style == "text":
        output.show(report, style, sys.stdout)
        if verdict:
            sys.stdout.write(f"{_summary(verdict, typed.levels)}\n")
    else:
        output.write_report(report, style, CheckResult(()), sys.stdout, command="breaking")
        if style == "github" and verdict:
            sys.stdout.write(notice("idlc breaking", _summary(verdict, typed.levels)))


def _summary(
    verdict: Verdict | GraphVerdict | RecordedVerdict, levels: tuple[str, ...] = ()
) -> str:
    """Return the last line of the text, with what was not compared or not shown."""
    from idlc.compare.breaking import Verdict
    from idlc.diagnostics.terminal import counted

    parts = [f"{number} {level}" for level, number in verdict.levels.items() if number]
    left_out = verdict.not_compared if isinstance(verdict, Verdict) else ()
    text = f"breaks: {', '.join(parts)}" if parts else "nothing breaks"
    if verdict.hidden:
        at = "" if parts else f" at level {', '.join(levels)}"
        text += f"{at}; --level hides {counted(verdict.hidden, 'change')}"
    if left_out:
        within = "" if parts or verdict.hidden else " in what was compared"
        text += f"{within}; not compared: {len(left_out)}"
    if verdict.allowed:
        text += f"; allowed: {verdict.allowed}"
    return text + (_next(verdict) if isinstance(verdict, Verdict) else _seen(verdict))


def _seen(verdict: GraphVerdict | RecordedVerdict) -> str:
    """Return the numbers of compared things, and of changes that are not reported."""
    from idlc.diagnostics.terminal import counted

    seen = [counted(number, noun) for noun, number in verdict.seen.items()]
    text = f"; looked at {', '.join(seen)}"
    facts = verdict._asdict()
    if silent := facts.get("silent"):
        text += f"; without type hash: {silent}"
    if others := facts.get("others"):
        text += f"; {counted(others, 'change')} that no reader sees; --level shows them"
    return text


def _next(verdict: Verdict) -> str:
    """Return the added interfaces, and the next version."""
    from idlc.diagnostics.report import first_few

    text = f"; added: {first_few(verdict.added, 5)}" if verdict.added else ""
    if verdict.part is None:
        facts = (verdict.allowed, verdict.added, verdict.not_compared, verdict.hidden)
        same = not any((*verdict.levels.values(), *facts))
        return f"{text}; the versions are the same" if same else text
    if verdict.next_version:
        return f"{text}; the next version after {verdict.version} is {verdict.next_version}"
    return f"{text}; raise the {verdict.part} version"


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

LEVEL_NAMES = ("wire", "hash", "source", "behaviour")


@click.command("breaking", epilog=EPILOG)
@click.argument("paths", metavar="[PATH]...", nargs=-1, type=click.Path())
@click.option(
    "--against",
    metavar="DIR|git:REF|idlc.lock|REC|distro:NAME|graph",
    help="The version to compare with: a folder, a git revision, the type hashes in a lock, "
    "recordings (a pattern such as 'bags/*.mcap' means several), the standard interfaces of a "
    "distribution, or what the nodes of the running ROS 2 graph use (a folder of that name is "
    "./graph).",
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
    type=click.Choice(LEVEL_NAMES),
    help="Only report what breaks this. May be repeated; otherwise all, or against recordings what "
    "readers of them would notice.",
)
@options.package
@options.include
@options.exclude
@options.distro
@options.report_style
def command(**arguments: Any) -> int:
    """Report what a new version of interfaces breaks, and for whom.

    wire: bytes recorded before are read wrongly or not at all. hash: the middleware may not
    deliver messages between both versions. source: code fails. behaviour: the same code does
    something else.

    With distro:NAME, the standard interfaces that PATH uses are compared with that
    distribution's, or all of them if there is no PATH.

    Against recordings, the question is whether they can still be read: interfaces of PATH that
    were recorded are compared, or without PATH all that are known here.

    Against the graph, it reports the types of which running nodes have several versions, or
    another one than the files here or the installed packages.
    """
    return compare(BreakingArguments(**arguments))
