"""`idlc echo`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import completion, options


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
def command(**arguments: Any) -> None:
    """Print the messages of a robot's topic as they arrive.

    ADDRESS is `dds`, or the endpoint of the robot's Zenoh router, such as tcp/robot:7447. To use a
    Zenoh configuration file instead, write zenoh:FILE. ROS_DOMAIN_ID selects the domain. idlc needs
    no interface files, because the robot's nodes send the definition of the type.

    In CSV, lists are JSON. In JSON, numbers that are not finite are null. On a terminal, YAML
    shows the first 16 elements of an array that has more than 32.
    """
    from idlc.cli.run.robots import echo

    return echo(**arguments)
