"""`idlc show`."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import click

from idlc.cli import completion, options

if TYPE_CHECKING:
    from idlc.diagnostics.report import Report
    from idlc.documents.show import TopicFacts
    from idlc.project.settings import Scope

#: Characters of a hash that people compare.
SHORT = len("RIHS01_") + 8
HEAD = ("topic", "type", "messages", "hash", "here")


def _table(topic_facts: Sequence[TopicFacts]) -> Iterator[str]:
    from idlc.diagnostics.text import display_width, one_line

    rows: list[tuple[str, ...]] = [HEAD] if topic_facts else []
    for facts in topic_facts:
        count = "?" if facts.messages is None else str(facts.messages)
        hash_ = one_line(facts.hash or "-")
        no_definition = "" if facts.definition else "; no definition in the recording"
        name = one_line(facts.name)
        # lines that begin with other characters may be commands to a CI system
        name = name if name[:1].isalnum() or name[:1] in ("/", "_") else f"`{name}`"
        type_ = one_line(facts.type_name)
        rows.append((name, type_, count, hash_[:SHORT], facts.here + no_definition))
    widths = [max(map(display_width, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = []
        for head, text, width in zip(HEAD, row, widths, strict=True):
            space = " " * (width - display_width(text))
            cells.append(space + text if head == "messages" else text + space)
        yield "  ".join(cells).rstrip() + "\n"


@click.command("show", epilog=options.example("idlc show geometry_msgs/msg/PoseStamped"))
@click.argument(
    "subject", metavar="TYPE|PATH|REC", type=click.Path(), shell_complete=completion.types_and_paths
)
@click.argument("topics", metavar="[TOPIC]...", nargs=-1, shell_complete=completion.topics)
@options.output_style(
    ("text", "json", "ros2idl", "jsonschema", "mcap"),
    "For people, or for other tools: facts as JSON, IDL, a JSON Schema, an MCAP schema.",
)
@options.scoped(options.package, options.include, options.distro)
def command(
    subject: str, topics: tuple[str, ...], style: str, scope: Scope, report: Report
) -> None:
    """Show an interface with the messages in it and all comments.

    REC is a recording, an .mcap or .db3 file or the folder of a bag: of that, its topics with their
    types, counts and type hashes are shown, and whether the types known here are the same; or, with
    TOPIC, the definitions of their types.
    """
    from idlc.cli import output
    from idlc.documents import show
    from idlc.recordings.find import is_recording

    if not is_recording(subject, scope.root):
        if topics:
            raise click.UsageError(f"`{subject}` is no recording, so it has no topics")
        output.texts(show.show(subject, style, scope, report), style, sys.stdout)
    elif topics:
        definitions = show.definitions(subject, topics, style, scope, report)
        output.texts(definitions, style, sys.stdout)
    elif style == "json":
        for facts in show.topics(subject, scope, report):
            output.fact(sys.stdout, "topic", **facts._asdict())
    elif style == "text":
        sys.stdout.writelines(_table(show.topics(subject, scope, report)))
    else:
        raise click.UsageError(f"--format {style} shows types: name a topic")
