"""`idlc upgrade`: the plan of a dry run, and the results."""

from __future__ import annotations

import shlex
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import click

from idlc.cli import options, output
from idlc.diagnostics.report import ReportedError
from idlc.diagnostics.source import Span
from idlc.diagnostics.terminal import counted
from idlc.diagnostics.text import one_line
from idlc.project.root import Root
from idlc.project.settings import scope, settings_here
from idlc.project.words import expand, split_topics
from idlc.tasks.upgrade.recordings import (
    TopicPlan,
    UpgradeOptions,
    UpgradeResult,
    upgrade_recordings,
)

if TYPE_CHECKING:
    from idlc.recordings.rewrite import Rewritten
    from idlc.versions.conversion import FieldFate


def _place(span: Span | None) -> str:
    if span is None:
        return ""
    line, column = span.source.position(span.start)
    return f"{span.source.path}:{line}:{column}"


def _lines(plans: list[TopicPlan]) -> list[str]:
    """Return the plan as text: a block for each topic, with a line for each field."""
    lines: list[str] = []
    recording = ""
    for entry in plans:
        if entry.recording != recording:
            recording = entry.recording
            lines.append(recording)
        change = entry.type
        if entry.plan is not None:
            old, new = entry.plan.old.key, entry.plan.new.key
            renamed = "" if old.type == new.type else f"{new.type} "
            versions = (key.hash.rpartition("_")[2][:6] for key in (old, new))
            change += f" {f' → {renamed}'.join(versions)}"
        lines.append(f"  {entry.topic}: {change}: {entry.fate}")
        for finding in entry.findings:
            place = _place(finding.span)
            lines.append(f"    {finding.fate}: {finding.path or entry.type}: {finding.reason}")
            if place:
                lines.append(f"      {place}")
    return list(map(one_line, lines))


def _facts(entry: TopicPlan) -> dict[str, object]:
    plan = entry.plan
    return {
        "recording": entry.recording,
        "topic": entry.topic,
        "type_name": entry.type,
        "hash": plan and plan.old.key.hash,
        "new_type_name": plan and plan.new.key.type,
        "new_hash": plan and plan.new.key.hash,
        "fate": entry.fate,
        "findings": [_finding(finding) for finding in entry.findings],
    }


def _finding(finding: FieldFate) -> dict[str, object]:
    facts = finding._asdict()
    return {**facts, "span": _place(finding.span), "old": _place(finding.old)}


def run(
    paths: tuple[str, ...],
    out: str | None,
    style: str,
    package: str | None = None,
    include: tuple[str, ...] = (),
    exclude: tuple[str, ...] = (),
    distro: str | None = None,
    **arguments: Any,
) -> int:
    """Run the command and return the exit status."""
    settings, report = settings_here()
    if out is None and not arguments["dry_run"] and arguments["write_rules"] is None:
        raise click.UsageError("missing option '-o'; give a folder for the new recordings")
    words = dict.fromkeys(path for word in paths for path in expand(word) or [word])
    recordings, topics = split_topics(tuple(words), Root.here())
    again = shlex.join(("idlc", "upgrade", *options.typed("write_rules", "dry_run", "style")))
    where = scope(settings, package, include, exclude, distro)
    request = UpgradeOptions(recordings, where, out, topics=topics, again=again, **arguments)
    result = UpgradeResult([], [], [], {}, {})
    with suppress(ReportedError):
        report.raise_errors()
        with output.progress_bar(sys.stderr) as update:
            result = upgrade_recordings(request, report, update)
    _show(result, request, style, failed=report.had_errors)
    output.show(report, style, sys.stdout if style == "json" else sys.stderr)
    output.notes(report, sys.stderr)
    if style == "json":
        output.fact(sys.stdout, "summary", **output.counts(report))
    return output.status(report)


def _show(result: UpgradeResult, request: UpgradeOptions, style: str, *, failed: bool) -> None:
    """Write the plan of a dry run, the files of rules, and a summary of each topic."""
    if style == "json":
        for entry in result.plans:
            output.fact(sys.stdout, "topic", **_facts(entry))
        for recording, path, written in result.written:
            topics = {name: topic._asdict() for name, topic in written.topics.items()}
            output.fact(sys.stdout, "recording", recording=recording, path=path, topics=topics)
        return
    if request.dry_run and result.plans:
        output.texts(("".join(f"{line}\n" for line in _lines(result.plans)),), "text", sys.stdout)
    elif request.dry_run and not failed:
        sys.stdout.write("no types changed\n")
    for path in result.stubs:
        sys.stdout.write(f"{path}\n")
    for recording, path, written in result.written:
        plans = [entry for entry in result.plans if entry.recording == recording]
        lines = [f"{recording} → {path}", *_fates(plans, written)]
        unread = result.unread[recording]
        lines += [f"  {name}: copied, because its type is not known" for name in unread]
        if len(lines) == 1:
            lines.append("  no types changed")
        output.texts(("".join(f"{one_line(line)}\n" for line in lines),), "text", sys.stdout)


def _fates(plans: Iterable[TopicPlan], written: Rewritten) -> Iterator[str]:
    """Yield a line for each topic that was changed, or each of its types if it has several."""
    messages: Counter[tuple[str, str]] = Counter()
    for entry in plans:
        topic = entry.rewritten(written)
        if topic is not None:
            name = f"{entry.topic} ({entry.type})" if entry.several else entry.topic
            fate = "converted" if topic.converted else "copied under the new definition"
            messages[name, fate if entry.plan else "kept under the old type"] += topic.messages
    for (name, fate), count in messages.items():
        yield f"  {name}: {counted(count, 'message')} {fate}"
