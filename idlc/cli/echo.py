"""`idlc echo`."""

from __future__ import annotations

import sys

import click

from idlc.cli import completion, options


@click.command(
    "echo",
    epilog=options.example(
        "idlc echo tcp/robot:7447 /odom",
        "idlc echo tcp/robot:7447 /odom --count 100 --format csv > odom.csv",
    ),
)
@click.argument("address", metavar="ADDRESS")
@click.argument("topic", metavar="TOPIC", shell_complete=completion.robot_topics)
@click.option(
    "--count",
    metavar="N",
    type=click.IntRange(min=1),
    help="Stop after this number of messages.  [default: Ctrl-C stops]",
)
@options.output_style(
    ("yaml", "json", "csv"), "Output format: YAML documents, one JSON object per line, or CSV."
)
def command(address: str, topic: str, count: int | None, style: str) -> int:
    """Print the messages of a robot's topic as they arrive.

    ADDRESS is the endpoint of the robot's Zenoh router, such as tcp/robot:7447. To use a Zenoh
    configuration file instead, write zenoh:FILE. ROS_DOMAIN_ID selects the domain. idlc needs no
    interface files, because the robot's nodes send the definition of the type.

    In CSV, lists are JSON. In JSON, numbers that are not finite are null.
    """
    from idlc.cli import output
    from idlc.diagnostics.report import Report
    from idlc.robot.live import traffic
    from idlc.robot.live.connect import connected, find_endpoints

    report = Report()
    try:
        with connected(address, report) as session:
            ends = find_endpoints(session, topic, traffic.TOPICS, report) if session else []
            chosen = traffic.version_of(ends, report) if ends else []
            kind = None
            if session and chosen:
                kind = traffic.interface_class(session, address, chosen[0], report)
            if session and kind:
                output.notes(report, sys.stderr)
                report.notes.clear()
                text = traffic.formatter(style, kind)
                for message in traffic.messages(session, chosen, kind, count, report):
                    output.lines(text(message), sys.stdout)
                    sys.stdout.flush()
    except KeyboardInterrupt:
        pass
    output.show(report, "text", sys.stderr)
    output.notes(report, sys.stderr)
    return output.status(report)
