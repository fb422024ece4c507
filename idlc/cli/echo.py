"""`idlc echo`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from idlc.cli import completion, options

if TYPE_CHECKING:
    from idlc.diagnostics.report import Report
    from idlc.robot.session import Session


@click.command(
    "echo",
    epilog=options.example(
        "idlc echo tcp/robot:7447 /odom",
        "idlc echo tcp/robot:7447 /odom --fields pose.pose.position",
        "idlc echo tcp/robot:7447 /odom --count 100 --format csv > odom.csv",
    ),
)
@options.on_robot
@click.argument("topic", metavar="TOPIC", shell_complete=completion.robot_names)
@click.option(
    "--count",
    metavar="N",
    type=click.IntRange(min=1),
    help="Stop after this number of messages.  [default: Ctrl-C stops]",
)
@click.option(
    "--fields",
    metavar="FIELD,...",
    help="Print only these fields, such as `header.stamp,position[0]`. idlc decodes nothing else.",
)
@options.output_style(
    ("yaml", "json", "csv"), "Output format: YAML documents, one JSON object per line, or CSV."
)
def command(
    topic: str,
    count: int | None,
    fields: str | None,
    style: str,
    session: Session,
    report: Report,
    include: tuple[str, ...],
) -> None:
    """Print the messages of a robot's topic as they arrive.

    ADDRESS is `dds`, or the endpoint of the robot's Zenoh router, such as tcp/robot:7447. To use a
    Zenoh configuration file instead, write zenoh:FILE. ROS_DOMAIN_ID selects the domain. idlc needs
    no interface files, because the robot's nodes send the definition of the type.

    In CSV, lists are JSON. In JSON, numbers that are not finite are null. On a terminal, YAML
    shows the first 16 elements of an array that has more than 32.
    """
    from idlc.cli import messages, output
    from idlc.diagnostics.text import one_line
    from idlc.robot.live import traffic
    from idlc.robot.live.connect import TOPICS

    kind, ends = traffic.find_version(session, topic, TOPICS, report, include)
    if kind is None:
        return
    output.notes(report, sys.stderr)
    report.notes.clear()
    read: Callable[[bytes], dict[str, Any]] = partial(_read_all, kind)
    if fields is not None:
        try:
            read = messages.fields_of(kind, [path.strip() for path in fields.split(",")])
        except ValueError as error:
            raise click.UsageError(str(error)) from None

    def complain(reason: str) -> None:
        sys.stderr.write(f"note: {one_line(reason)}\n")
        sys.stderr.flush()

    arrived = traffic.messages(session, ends, read, count, report, complain, kind)
    with suppress(KeyboardInterrupt):
        for text in messages.texts(style, arrived, is_brief=sys.stdout.isatty()):
            output.lines(text, style, sys.stdout)
            sys.stdout.flush()


def _read_all(kind: Any, buffer: bytes) -> dict[str, Any]:
    values: dict[str, Any] = kind.deserialize(buffer).to_dict()
    return values
