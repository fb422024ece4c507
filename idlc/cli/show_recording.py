"""The body of `idlc show REC`: a table for people, a JSON line for each topic for programs."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import click

from idlc.cli import output
from idlc.diagnostics.report import Report
from idlc.diagnostics.visible import display_width, one_line
from idlc.disk.scope import Scope
from idlc.driver.recordings.show import TopicFacts, definitions, topics

#: Characters of a hash that people compare.
SHORT = len("RIHS01_") + 8
HEAD = ("topic", "type", "messages", "hash", "here")


def show_recording(
    path: str, wanted: Sequence[str], style: str, scope: Scope, report: Report
) -> int:
    """Show the topics of a recording, or the definitions of wanted ones; return the exit status."""
    if wanted:
        output.texts(definitions(path, wanted, style, scope, report), style, sys.stdout)
    elif style not in ("text", "json"):
        raise click.UsageError(f"--format {style} shows types: name a topic")
    else:
        found = topics(path, scope, report)
        if style == "json":
            for one in found:
                output.fact(sys.stdout, "topic", **one._asdict())
        else:
            sys.stdout.writelines(_table(found))
    output.show(report, "text", sys.stderr)
    output.notes(report, sys.stderr)
    return output.status(report)


def _table(found: Sequence[TopicFacts]) -> list[str]:
    rows = [HEAD, *map(_row, found)] if found else []
    widths = [max(map(display_width, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(map(_padded, row, widths, range(len(row)))).rstrip() + "\n" for row in rows]


def _row(one: TopicFacts) -> tuple[str, ...]:
    count = "?" if one.messages is None else str(one.messages)
    hash_ = one_line(one.hash or "-")
    here = one.here if one.definition else f"{one.here}; no definition in the recording"
    name = one_line(one.name)
    # lines that begin with other characters may be commands to a CI system
    name = name if name[:1].isalnum() or name[:1] in ("/", "_") else f"`{name}`"
    return name, one_line(one.type_name), count, hash_[:SHORT], here


def _padded(text: str, width: int, column: int) -> str:
    space = " " * (width - display_width(text))
    return space + text if HEAD[column] == "messages" else text + space
