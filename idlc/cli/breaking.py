"""`idlc breaking`."""

from __future__ import annotations

import datetime
import sys
from typing import TYPE_CHECKING, Any

import click

from idlc.cli import options

if TYPE_CHECKING:
    from idlc.diagnostics.report import Report
    from idlc.tasks.breaking.files import Verdict
    from idlc.tasks.breaking.graph import GraphVerdict
    from idlc.tasks.breaking.recordings import RecordedVerdict
GRAPH = "graph"
PATIENCE = 5.0


#: For each broken level, the worst first, the consequence: for nodes, and for recordings.
_CONSEQUENCES = {
    "wire": ("nodes built from different versions cannot talk", "the recordings are misread"),
    "hash": ("nodes built from different versions cannot talk", "the type hashes differ"),
    "source": ("code that uses the old version fails",) * 2,
    "behaviour": ("the same code behaves differently",) * 2,
}


def _summary(
    verdict: Verdict | GraphVerdict | RecordedVerdict, levels: tuple[str, ...], report: Report
) -> str:
    """Return the last line of the text: changes, consequence, omissions and the next version."""
    from idlc.diagnostics.report import first_few
    from idlc.diagnostics.terminal import counted
    from idlc.tasks.breaking.files import Verdict
    from idlc.tasks.breaking.recordings import RecordedVerdict

    broken = {level: number for level, number in verdict.levels.items() if number}
    text = "no breaking changes"
    if broken:
        parts = ", ".join(f"{number} {level}" for level, number in broken.items())
        number = sum(bool(problem.levels) for problem in report)
        consequence = _CONSEQUENCES[next(iter(broken))][isinstance(verdict, RecordedVerdict)]
        text = f"{counted(number, 'breaking change')} ({parts}): {consequence}"
    if verdict.hidden:
        at = "" if broken else f" at level {', '.join(levels)}"
        text += f"{at}; --level hides {counted(verdict.hidden, 'change')}"
    if isinstance(verdict, Verdict) and verdict.not_compared:
        text += f"; {len(verdict.not_compared)} not compared"
    if verdict.allowed:
        text += f"; {verdict.allowed} allowed"
    if not isinstance(verdict, Verdict):
        seen = [counted(number, noun) for noun, number in verdict.seen.items()]
        text += f"; compared {', '.join(seen)}"
        facts = verdict._asdict()
        if silent := facts.get("silent"):
            text += f"; {counted(silent, 'endpoint')} without a type hash"
        if others := facts.get("others"):
            text += f"; hidden: {counted(others, 'change')} without effect on readers (see --level)"
        return text
    if verdict.added:
        text += f"; added: {first_few(verdict.added, 5)}"
    if verdict.part is None:
        numbers = (*verdict.levels.values(), verdict.allowed, verdict.hidden)
        same = not any((*numbers, verdict.added, verdict.not_compared))
        return f"{text}; the versions are the same" if same else text
    if verdict.next_version:
        return f"{text}; suggested version: {verdict.next_version} (now {verdict.version})"
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
    metavar="DIR|git:REF|idlc.lock|REC|distro:NAME|graph|ADDRESS",
    help="The version to compare with: a folder, a git revision, the type hashes in idlc.lock, a "
    "recording, or the standard interfaces of a distribution. For several recordings, write a "
    "pattern, such as 'bags/*.mcap'. To compare with running nodes, write the word "
    "'graph', or the address of a robot, such as tcp/robot:7447. For a folder named graph, write "
    "./graph.",
)
@click.option(
    "--timeout",
    metavar="SECONDS",
    type=click.FloatRange(min=0, min_open=True),
    help="With --against graph or ADDRESS, stop waiting for nodes and replies after this time.  "
    "[default: 5]",
)
@click.option(
    "--level",
    "levels",
    multiple=True,
    type=click.Choice(("wire", "hash", "source", "behaviour")),
    help="Report only changes with this level. May be repeated. By default, idlc reports all "
    "changes. If you compare with recordings, it reports only changes that affect programs that "
    "read recordings.",
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
    """Compare two versions of interfaces and report breaking changes.

    idlc assigns one or more of these levels to each breaking change:

    \b
    wire       existing data is misread or unreadable
    hash       the type hash differs, so middleware might not deliver messages
    source     code that uses the interface fails
    behaviour  the same code behaves differently

    With distro:NAME, idlc compares two versions of each standard interface that PATH uses: the
    version in your distribution and the version in the distribution NAME. Without PATH, it compares
    all standard interfaces.

    With a recording, idlc reports changes that prevent programs with your interfaces from reading
    the recording. Without PATH, it compares every recorded type that it also finds on this machine.
    If PATH is a recording, too, it compares the recorded types.

    With graph or the address of a robot, idlc reports types of which running nodes use different
    versions. It also compares these versions with your files and your installed packages.
    """  # noqa: D301  (click needs the character, not the escape)
    from idlc.cli import output
    from idlc.project.find import is_address
    from idlc.project.git import GIT
    from idlc.project.settings import scope, settings_here
    from idlc.tasks.breaking.files import BreakingOptions, breaking
    from idlc.versions import packages
    from idlc.versions.changes import LEVELS
    from idlc.versions.distribution import is_distro

    settings, report = settings_here()
    against = against or packages.against(settings, report)
    allowed = packages.allowances(settings, report)
    if against is None and not report.had_errors:
        raise click.UsageError(
            "missing option '--against'; give DIR, git:REF, idlc.lock, a recording, distro:NAME "
            "or graph"
        )
    is_running = against == GRAPH or is_address(against or "")
    if timeout is not None and not is_running:
        raise click.UsageError("--timeout needs --against graph")
    verdict: Verdict | GraphVerdict | RecordedVerdict | None = None
    if against is not None and not report.had_errors:
        recordings: tuple[str, ...] = ()
        files = paths
        if not is_running and not is_distro(against) and not against.startswith(GIT):
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
            from idlc.tasks.breaking.recordings import compare_with_recordings

            verdict = compare_with_recordings(comparison, recordings, report)
            output.notes(report, sys.stderr)
        elif is_running:
            from idlc.tasks.breaking.graph import compare_with_graph

            patience = timeout or PATIENCE
            verdict = compare_with_graph(comparison, patience, report, has_paths=bool(paths))
        else:
            verdict = breaking(comparison, report)
    text = _summary(verdict, levels, report) if verdict else ""
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
