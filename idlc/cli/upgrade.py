"""`idlc upgrade`."""

from __future__ import annotations

import shlex
import sys
from typing import TYPE_CHECKING, Any

import click

from idlc.cli import options

if TYPE_CHECKING:
    from idlc.diagnostics.source import Span
    from idlc.tasks.upgrade.recordings import Result, TopicPlan, UpgradeOptions
    from idlc.versions.conversion import Finding


def _place(span: Span | None) -> str:
    if span is None:
        return ""
    line, column = span.source.position(span.start)
    return f"{span.source.path}:{line}:{column}"


def _lines(plans: list[TopicPlan]) -> list[str]:
    """Return the plan as text: a block for each topic, with a line for each field."""
    from idlc.diagnostics.text import one_line

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


def _finding(finding: Finding) -> dict[str, object]:
    facts = finding._asdict()
    return {**facts, "span": _place(finding.span), "old": _place(finding.old)}


EPILOG = options.example(
    "idlc upgrade rec.mcap --to distro:lyrical --dry-run",
    "idlc upgrade rec.mcap --to distro:lyrical -o upgraded",
)
EPILOG += "\n" + options.example(
    "idlc upgrade 'bags/*.mcap' --to my_msgs --write-rules my_msgs/upgrade",
    "idlc upgrade 'bags/*.mcap' --to my_msgs --rules my_msgs/upgrade -o upgraded",
    title="Write rules for renamed fields, edit them, and run them",
)


@click.command("upgrade", epilog=EPILOG)
@click.argument("paths", metavar="REC...", nargs=-1, required=True, type=click.Path())
@click.option(
    "-o",
    "--out",
    metavar="DIR",
    type=click.Path(),
    help="The folder to write the new recordings to. idlc does not change the original recordings.",
)
@click.option(
    "--to",
    metavar="PATH|REC|git:REF|distro:NAME",
    help="The types to upgrade to: a package folder, another recording, a git revision, or the "
    "standard interfaces of a distribution. By default, idlc uses the types of this machine.",
)
@click.option(
    "--from",
    "old",
    metavar="PATH|REC|git:REF|distro:NAME",
    help="The old types, for recordings that do not contain their definitions, such as .db3 files "
    "of Humble.",
)
@click.option(
    "--topic",
    "topics",
    metavar="TOPIC",
    multiple=True,
    help="Upgrade only this topic. May be repeated.",
)
@click.option(
    "--rules",
    metavar="PATH",
    multiple=True,
    type=click.Path(),
    help="Run the rules in this Python file or folder. Without --rules, idlc runs no rules. May be "
    "repeated.",
)
@click.option(
    "--write-rules",
    metavar="DIR",
    type=click.Path(),
    help="Write a Python file with a function for each field that needs a rule.",
)
@click.option("--dry-run", is_flag=True, help="Show how idlc converts each changed field.")
@click.option(
    "--allow-loss",
    is_flag=True,
    help="If the new version does not contain the type of a message, keep the message unchanged.",
)
@click.option("--strict", is_flag=True, help="Refuse a damaged recording.")
@options.packages
@options.distro
@options.style
def command(
    paths: tuple[str, ...],
    out: str | None,
    style: str,
    package: str | None = None,
    include: tuple[str, ...] = (),
    exclude: tuple[str, ...] = (),
    distro: str | None = None,
    **arguments: Any,
) -> int:
    """Convert recordings to the current versions of their types.

    REC is an .mcap or .db3 file, a bag folder, or a pattern such as 'drive_*.mcap'. idlc compares
    the recorded definitions with the new ones. Added fields get their defaults, removed fields are
    dropped, and numbers get wider types. Other changes need a rule: a Python function that returns
    the value of the new field.
    """
    from idlc.cli import output
    from idlc.project.settings import scope, settings_here
    from idlc.recordings.find import expand
    from idlc.tasks.upgrade.recordings import Result, UpgradeOptions, upgrade_recordings

    settings, report = settings_here()
    if out is None and not arguments["dry_run"] and arguments["write_rules"] is None:
        raise click.UsageError("missing option '-o'; give a folder for the new recordings")
    recordings = tuple(dict.fromkeys(path for word in paths for path in expand(word) or [word]))
    again = shlex.join(("idlc", "upgrade", *options.typed("write_rules", "dry_run", "style")))
    where = scope(settings, package, include, exclude, distro)
    request = UpgradeOptions(recordings, where, out, again=again, **arguments)
    result = Result([], [], [], {})
    if not report.had_errors:
        with output.progress_bar(sys.stderr) as update:
            result = upgrade_recordings(request, report, update)
    _show(result, request, style, failed=report.had_errors)
    output.show(report, style, sys.stdout if style == "json" else sys.stderr)
    output.notes(report, sys.stderr)
    if style == "json":
        output.fact(sys.stdout, "summary", **output.counts(report))
    return output.status(report)


def _show(result: Result, request: UpgradeOptions, style: str, *, failed: bool) -> None:
    """Write the plan of a dry run, the files of rules, and a summary of each topic."""
    from idlc.cli import output
    from idlc.diagnostics.terminal import counted
    from idlc.diagnostics.text import one_line

    if style == "json":
        for entry in result.plans:
            output.fact(sys.stdout, "topic", **_facts(entry))
        for recording, path, topics in result.written:
            written = {name: topic._asdict() for name, topic in topics.items()}
            output.fact(sys.stdout, "recording", recording=recording, path=path, topics=written)
        return
    if request.dry_run and result.plans:
        output.texts(("".join(f"{line}\n" for line in _lines(result.plans)),), "text", sys.stdout)
    elif request.dry_run and not failed:
        sys.stdout.write("no types changed\n")
    for path in result.stubs:
        sys.stdout.write(f"{path}\n")
    for recording, path, topics in result.written:
        lines = [f"{recording} → {path}"]
        for entry in result.plans:
            if entry.recording == recording and entry.topic in topics:
                topic = topics[entry.topic]
                fate = "converted" if topic.converted else "copied under the new definition"
                fate = fate if entry.plan else "kept under the old type"
                line = f"  {entry.topic}: {counted(topic.messages, 'message')} {fate}"
                lines += [line] if line not in lines else []
        if len(lines) == 1:
            lines.append("  no types changed")
        output.texts(("".join(f"{one_line(line)}\n" for line in lines),), "text", sys.stdout)
