"""`idlc breaking`: comparing, and the summary."""

from __future__ import annotations

import datetime
import sys
from collections.abc import Iterator
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import click

from idlc.cli import options, output
from idlc.diagnostics import codes
from idlc.diagnostics.formats import notice
from idlc.diagnostics.report import Report, ReportedError, first_few
from idlc.diagnostics.terminal import counted
from idlc.project.git import commit, repository_of
from idlc.project.root import Root
from idlc.project.settings import Config, scope, settings_here
from idlc.project.words import is_address, read_version, recordings_of
from idlc.tasks.breaking.files import BreakingOptions, Verdict, breaking
from idlc.tasks.breaking.recordings import RecordedVerdict, compare_with_recordings
from idlc.versions import packages
from idlc.versions.changes import LEVELS

if TYPE_CHECKING:
    from idlc.tasks.breaking.graph import GraphVerdict
    from idlc.versions.packages import Allowance


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
    added = verdict.added if isinstance(verdict, Verdict) else ()
    parts = []
    if verdict.not_compared:
        parts.append(f"{len(verdict.not_compared)} not compared")
    parts += _result(verdict, levels, report)
    if verdict.hidden:
        parts.append(f"`levels` in [tool.idlc.breaking] hides {counted(verdict.hidden, 'change')}")
    if verdict.allowed:
        parts.append(f"{verdict.allowed} allowed")
    parts.append(
        f"compared {', '.join(counted(number, noun) for noun, number in verdict.seen.items())}"
    )
    if added:
        parts.append(f"added: {first_few(added, 5)}")
    if isinstance(verdict, Verdict):
        parts += _advice(verdict)
    elif isinstance(verdict, RecordedVerdict):
        if verdict.others:
            others = counted(verdict.others, "more change")
            verb = "does" if verdict.others == 1 else "do"
            parts.append(f"{others} {verb} not affect readers")
    elif verdict.silent:
        parts.append(f"{counted(verdict.silent, 'endpoint')} without a type hash")
    return "; ".join(parts)


def _result(
    verdict: Verdict | GraphVerdict | RecordedVerdict, levels: tuple[str, ...], report: Report
) -> Iterator[str]:
    """Yield the changes with their consequence, or that there are none; nothing without a yes."""
    broken = {level: number for level, number in verdict.levels.items() if number}
    if broken:
        levels_of = ", ".join(f"{number} {level}" for level, number in broken.items())
        number = sum(bool(problem.levels) for problem in report)
        consequence = _CONSEQUENCES[next(iter(broken))][isinstance(verdict, RecordedVerdict)]
        yield f"{counted(number, 'breaking change')} ({levels_of}): {consequence}"
        return
    if any(problem.code == codes.NOTHING_COMPARED.id for problem in report):
        return
    added = verdict.added if isinstance(verdict, Verdict) else ()
    if added or any(verdict.seen.values()):
        rest = " in the rest" if verdict.not_compared else ""
        at = f" at {', '.join(levels)} level" if verdict.hidden else ""
        yield f"no breaking changes{rest}{at}"


def _advice(verdict: Verdict) -> Iterator[str]:
    """Yield the version to give to the package, if there is one."""
    numbers = (*verdict.levels.values(), verdict.allowed, verdict.hidden)
    if verdict.next_version:
        yield f"suggested version: {verdict.next_version} (now {verdict.version})"
    elif verdict.part:
        yield f"raise the {verdict.part} version"
    elif not any((*numbers, verdict.added, verdict.not_compared)):
        yield "the versions are the same"


def run(
    paths: tuple[str, ...],
    against: str | None,
    timeout: float | None,
    style: str,
    **scoping: Any,
) -> int:
    """Run the command and return the exit status."""
    settings, report = settings_here()
    against = against or packages.against(settings, report) or _committed(settings.root, report)
    levels = packages.levels(settings, report)
    allowed = packages.allowances(settings, report)
    if against is None and not report.had_errors:
        raise click.UsageError(_nothing_to_compare(settings.root))
    is_running = against == GRAPH or is_address(against or "")
    if timeout is not None and not is_running:
        raise click.UsageError("--timeout needs --against graph")
    verdict: Verdict | GraphVerdict | RecordedVerdict | None = None
    with suppress(ReportedError):
        report.raise_errors()
        assert against is not None
        comparison = _comparison(paths, against, settings, levels, allowed, scoping)
        if is_running:
            from idlc.tasks.breaking.graph import compare_with_graph

            patience = timeout or PATIENCE
            verdict = compare_with_graph(comparison, patience, report, has_paths=bool(paths))
        else:
            verdict = _compare_files(comparison, paths, settings, levels, report)
    _show(verdict, style, levels, report)
    return output.status(report)


def _committed(root: Root, report: Report) -> str | None:
    """Return what the files of a repository are compared with if nothing is named."""
    for name in ("origin/HEAD", "HEAD"):
        # settings with errors may have named another version
        if not report.had_errors and commit(name, root.base):
            sys.stderr.write(f"note: idlc compares with `git:{name}`\n")
            return f"git:{name}"
    return None


def _nothing_to_compare(root: Root) -> str:
    """Return why a version to compare with has to be named, and a hint."""
    if repository_of(root.base) is None:
        choices = "DIR, git:REF, idlc.lock, a recording, distro:NAME or graph"
        return f"missing option '--against': this folder is in no git repository; give {choices}"
    what = "nothing to compare with: the git repository has no commits"
    return f"{what}; commit the current version, or name another one: `idlc breaking --against DIR`"


def _comparison(
    paths: tuple[str, ...],
    against: str,
    settings: Config,
    levels: tuple[str, ...],
    allowed: tuple[Allowance, ...],
    scoping: dict[str, Any],
) -> BreakingOptions:
    """Return the comparison of the paths, else of those in the settings, else of this folder."""
    paths = paths or settings.paths
    if not paths and read_version(against, settings.root).meaning != "distribution":
        paths = (".",)
    return BreakingOptions(
        paths=paths,
        against=against,
        scope=scope(settings, **scoping),
        levels=levels or LEVELS,
        allowed=allowed,
        allowed_in=settings.source.path if settings.source else "",
        today=datetime.datetime.now().astimezone().date().isoformat(),
    )


def _compare_files(
    comparison: BreakingOptions,
    paths: tuple[str, ...],
    settings: Config,
    levels: tuple[str, ...],
    report: Report,
) -> Verdict | RecordedVerdict:
    """Compare with a recording or with a version of the files; `paths` and `levels` are options."""
    import msgspec

    against = comparison.against
    if read_version(against, settings.root).meaning in ("revision", "distribution"):
        return breaking(comparison, report)
    recordings, newer, files = recordings_of(against, paths, settings.root)
    if not recordings:
        return breaking(comparison, report)

    current = () if newer else files or settings.paths
    comparison = msgspec.structs.replace(comparison, paths=current, levels=levels)
    try:
        return compare_with_recordings(comparison, recordings, newer, report)
    finally:
        output.notes(report, sys.stderr)


def _show(
    verdict: Verdict | GraphVerdict | RecordedVerdict | None,
    style: str,
    levels: tuple[str, ...],
    report: Report,
) -> None:

    text = _summary(verdict, levels, report) if verdict else ""
    if style in options.DOCUMENTS:
        output.document(report, style, "breaking")
        if style == "github" and verdict:
            output.lines(notice("idlc breaking", text), style, sys.stdout)
        return
    output.show(report, style, sys.stdout)
    if style == "json":
        facts = verdict._asdict() if verdict else {}
        for endpoint in facts.pop("endpoints", ()):
            output.fact(sys.stdout, "endpoint", **endpoint._asdict())
        output.fact(sys.stdout, "summary", **output.counts(report), **facts)
    elif verdict:
        sys.stdout.write(f"{text}\n")
