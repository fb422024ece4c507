"""`idlc show`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
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


def show_recording(
    path: str, selected: Sequence[str], style: str, scope: Scope, report: Report
) -> None:
    """Show the topics of a recording, or definitions of selected ones."""
    from idlc.cli import output
    from idlc.documents.show import definitions, topics

    if selected:
        output.texts(definitions(path, selected, style, scope, report), style, sys.stdout)
    elif style == "json":
        for facts in topics(path, scope, report):
            output.fact(sys.stdout, "topic", **facts._asdict())
    elif style == "text":
        sys.stdout.writelines(_table(topics(path, scope, report)))
    else:
        raise click.UsageError(f"--format {style} shows types: name a topic")


def _table(topic_facts: Sequence[TopicFacts]) -> list[str]:
    from idlc.diagnostics.text import display_width

    rows = [HEAD, *map(_row, topic_facts)] if topic_facts else []
    widths = [max(map(display_width, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(map(_padded, row, widths, range(len(row)))).rstrip() + "\n" for row in rows]


def _row(facts: TopicFacts) -> tuple[str, ...]:
    from idlc.diagnostics.text import one_line

    count = "?" if facts.messages is None else str(facts.messages)
    hash_ = one_line(facts.hash or "-")
    comparison = facts.here
    if not facts.definition:
        comparison += "; no definition in the recording"
    name = one_line(facts.name)
    # lines that begin with other characters may be commands to a CI system
    name = name if name[:1].isalnum() or name[:1] in ("/", "_") else f"`{name}`"
    return name, one_line(facts.type_name), count, hash_[:SHORT], comparison


def _padded(text: str, width: int, column: int) -> str:
    from idlc.diagnostics.text import display_width

    space = " " * (width - display_width(text))
    return space + text if HEAD[column] == "messages" else text + space


EPILOG = """\
Example:

\b
  idlc show geometry_msgs/msg/PoseStamped
"""


@click.command("show", epilog=EPILOG)
@click.argument(
    "subject",
    metavar="TYPE|PATH|REC",
    type=click.Path(),
    shell_complete=completion.types_and_paths,
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
    from idlc.documents.show import show
    from idlc.recordings.find import is_recording

    if is_recording(subject, scope.root):
        show_recording(subject, topics, style, scope, report)
    elif topics:
        raise click.UsageError(f"`{subject}` is no recording, so it has no topics")
    else:
        output.texts(show(subject, style, scope, report), style, sys.stdout)
