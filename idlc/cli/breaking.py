"""`idlc breaking`."""

from __future__ import annotations

import datetime
import sys
from typing import TYPE_CHECKING, Any

import click

from idlc.cli import options

if TYPE_CHECKING:
    from idlc.compare.breaking import Verdict
    from idlc.compare.recording import RecordedVerdict
    from idlc.compare.running import GraphVerdict
GRAPH = "graph"
PATIENCE = 5.0


def _summary(verdict: Verdict | GraphVerdict | RecordedVerdict, levels: tuple[str, ...]) -> str:
    """Return the last line of the text, with what was not compared or not shown."""
    from idlc.compare.breaking import Verdict
    from idlc.diagnostics.report import first_few
    from idlc.diagnostics.terminal import counted

    parts = [f"{number} {level}" for level, number in verdict.levels.items() if number]
    text = f"breaks: {', '.join(parts)}" if parts else "nothing breaks"
    if verdict.hidden:
        at = "" if parts else f" at level {', '.join(levels)}"
        text += f"{at}; --level hides {counted(verdict.hidden, 'change')}"
    if isinstance(verdict, Verdict) and verdict.not_compared:
        within = "" if parts or verdict.hidden else " in what was compared"
        text += f"{within}; not compared: {len(verdict.not_compared)}"
    if verdict.allowed:
        text += f"; allowed: {verdict.allowed}"
    if not isinstance(verdict, Verdict):
        seen = [counted(number, noun) for noun, number in verdict.seen.items()]
        text += f"; looked at {', '.join(seen)}"
        facts = verdict._asdict()
        if silent := facts.get("silent"):
            text += f"; without type hash: {silent}"
        if others := facts.get("others"):
            text += f"; {counted(others, 'change')} that no reader sees; --level shows them"
        return text
    if verdict.added:
        text += f"; added: {first_few(verdict.added, 5)}"
    if verdict.part is None:
        numbers = (*verdict.levels.values(), verdict.allowed, verdict.hidden)
        same = not any((*numbers, verdict.added, verdict.not_compared))
        return f"{text}; the versions are the same" if same else text
    if verdict.next_version:
        return f"{text}; the next version after {verdict.version} is {verdict.next_version}"
    return f"{text}; raise the {verdict.part} version"


EPILOG = options.example(
    "mkdir -p old/msg new/msg",
    "echo 'float64 speed 0.5  # [m/s]' > old/msg/Drive.msg",
    "echo 'float64 speed 0.7  # [m/s]' > new/msg/Drive.msg",
    "idlc breaking new --against old --level hash",
)
EPILOG += "\n" + options.example(
    "[[tool.idlc.breaking.allow]]",
    'at = "demo/msg/Drive.speed"',
    'reason = "all robots are updated in the same week"',
    "until = 2030-12-31",
    title="Allow an intentional change in pyproject.toml, with a reason and an end date",
)


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
    type=click.Choice(("wire", "hash", "source", "behaviour")),
    help="Only report what breaks this. May be repeated; otherwise all, or against recordings what "
    "readers of them would notice.",
)
@options.packages
@options.distro
@options.report_style
def command(
    paths: tuple[str, ...],
    against: str | None,
    timeout: float | None,
    levels: tuple[str, ...],
    style: str,
    **scoping: Any,
) -> int:
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
    from idlc.cli import output
    from idlc.compare import packages
    from idlc.compare.breaking import GIT, BreakingOptions, breaking
    from idlc.compare.changes import LEVELS
    from idlc.compare.distribution import is_distro
    from idlc.project.settings import scope, settings_here

    settings, report = settings_here()
    against = against or packages.against(settings, report)
    allowed = packages.allowances(settings, report)
    if against is None and not report.had_errors:
        raise click.UsageError(
            "give --against DIR, git:REF, idlc.lock, a recording, distro:NAME or graph"
        )
    if timeout is not None and against != GRAPH:
        raise click.UsageError("--timeout is for --against graph")
    verdict: Verdict | GraphVerdict | RecordedVerdict | None = None
    if against is not None and not report.had_errors:
        recordings: tuple[str, ...] = ()
        files = paths
        if against != GRAPH and not is_distro(against) and not against.startswith(GIT):
            from idlc.recordings.find import recordings_of

            recordings, files = recordings_of(against, paths, settings.root)
        needs_none = recordings or is_distro(against)
        comparison = BreakingOptions(
            paths=files or settings.paths or (() if needs_none else (".",)),
            against=against,
            scope=scope(settings, **scoping),
            levels=levels or (() if recordings else LEVELS),
            allowed=allowed,
            allowed_in=settings.source.path if settings.source else "",
            today=datetime.datetime.now().astimezone().date().isoformat(),
        )
        if recordings:
            from idlc.compare.recording import compare_with_recordings

            verdict = compare_with_recordings(comparison, recordings, report)
            output.notes(report, sys.stderr)
        elif against == GRAPH:
            from idlc.compare.running import compare_with_graph

            patience = timeout or PATIENCE
            verdict = compare_with_graph(comparison, patience, report, has_paths=bool(paths))
        else:
            verdict = breaking(comparison, report)
    text = _summary(verdict, levels) if verdict else ""
    if style in options.DOCUMENTS:
        output.document(report, style, "breaking")
        if style == "github" and verdict:
            from idlc.diagnostics.formats import notice

            sys.stdout.write(notice("idlc breaking", text))
        return output.status(report)
    output.show(report, style, sys.stdout)
    if style == "json":
        facts = verdict._asdict() if verdict else {}
        for endpoint in facts.pop("endpoints", ()):
            output.fact(sys.stdout, "endpoint", **endpoint._asdict())
        output.fact(sys.stdout, "summary", **output.counts(report), **facts)
    elif verdict:
        sys.stdout.write(f"{text}\n")
    return output.status(report)
