"""`idlc show`: interfaces, recordings and robots as text."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterator, Sequence

import click

from idlc.cli import options, output
from idlc.diagnostics.report import Report
from idlc.diagnostics.terminal import counted
from idlc.diagnostics.text import one_line
from idlc.project.settings import Scope
from idlc.project.words import is_address, read_word
from idlc.recordings.times import date_text
from idlc.tasks import show
from idlc.tasks.show import RecordingFacts, TopicFacts

HEAD = ("topic", "type", "messages", "rate", "size", "QoS", "hash", "installed")


def _table(topic_facts: Sequence[TopicFacts]) -> Iterator[str]:
    """Yield the lines of a table of topics."""
    rows: list[tuple[str, ...]] = [HEAD] if topic_facts else []
    for facts in topic_facts:
        count = "?" if facts.messages is None else str(facts.messages)
        hash_ = one_line(facts.hash or "-")
        no_definition = "" if facts.definition else "; no definition in the recording"
        name = one_line(facts.name)
        # lines that begin with other characters may be commands to a CI system
        name = name if name[:1].isalnum() or name[:1] in ("/", "_") else f"`{name}`"
        type_ = one_line(facts.type_name)
        rate = "-" if facts.rate is None else f"{facts.rate:.4g} Hz"
        size = "-" if facts.size is None else size_text(facts.size)
        qos, here = one_line(facts.qos or "-"), output.INSTALLED[facts.here] + no_definition
        rows.append((name, type_, count, rate, size, qos, hash_[: output.SHORT], here))
    yield from output.table(HEAD, rows)


def size_text(size: int) -> str:
    """Return a number of bytes with a unit."""
    value, units = float(size), iter(("B", "kB", "MB", "GB"))
    unit = next(units)
    while value >= 1000 and unit != "GB":
        value, unit = value / 1000, next(units)
    return f"{value:.4g} {unit}"


def _summary(subject: str, facts: RecordingFacts) -> str:
    """Return the line about a whole recording."""
    parts = [counted(facts.messages, "message"), size_text(facts.size)]
    if facts.start is not None and facts.end is not None:
        parts.append(f"{(facts.end - facts.start) / 1e9:.9g} s")
        parts.append(f"{date_text(facts.start)} to {date_text(facts.end)}")
    return f"{one_line(subject)}: {', '.join(parts)}\n"


def _recording(subject: str, style: str, scope: Scope, report: Report) -> None:
    """Write the summary of a recording, and its topics."""
    whole, topics = show.recording(subject, scope, report)
    if style == "json":
        if whole:
            output.fact(sys.stdout, "recording", **whole._asdict())
        for facts in topics:
            output.fact(sys.stdout, "topic", **facts._asdict())
        return
    if whole:
        sys.stdout.write(_summary(subject, whole))
    sys.stdout.writelines(_table(topics))


def run(
    subject: str,
    topics: tuple[str, ...],
    style: str,
    out: str | None,
    scope: Scope,
    report: Report,
) -> None:
    """Run the command."""
    is_of_recording = read_word(subject, scope.root) == "recording"
    if (style == "msg") != (out is not None) or (style == "msg" and not is_of_recording):
        raise click.UsageError("`--format msg` and `-o DIR` belong together, and need a recording")
    if out is not None:
        from idlc.api.sources import read_source
        from idlc.recordings.packages import write_definitions

        for path in write_definitions(read_source, subject, topics, out, scope, report):
            sys.stdout.write(f"{path}\n")
        return
    if style == "hash" and not (topics and is_of_recording):
        paint = output.painter(sys.stdout)
        for value, name in show.hashes((subject, *topics), scope, report):
            sys.stdout.write(f"{paint('value', value)}  {name}\n")
    elif not is_of_recording:
        if topics:
            raise click.UsageError(
                f"`{subject}` is not a recording; TOPIC selects from an .mcap or .db3 file or a bag"
            )
        texts = show.show(subject, style, scope, report)
        output.texts(texts, style, sys.stdout, interfaces=True)
    elif topics:
        definitions = show.definitions(subject, topics, style, scope, report)
        output.texts(definitions, style, sys.stdout, interfaces=True)
    elif is_address(subject) and style in options.FORMATS:
        from idlc.cli.run.robots import show_robot

        show_robot(subject, style, scope, report)
    elif style in ("json", "text"):
        _recording(subject, style, scope, report)
    else:
        command = shlex.join(("idlc", "show", subject))
        raise click.UsageError(f"--format {style} needs a topic; `{command}` lists them")
