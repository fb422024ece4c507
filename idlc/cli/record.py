"""`idlc record`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import completion, options


@click.command(
    "record",
    epilog=options.example(
        "idlc record tcp/robot:7447 -o drive.mcap /odom /scan --duration 60",
        "idlc columns drive.mcap /odom",
    ),
)
@options.on_robot
@click.argument("topics", metavar="[TOPIC]...", nargs=-1, shell_complete=completion.robot_names)
@click.option(
    "-o", "--out", metavar="FILE", required=True, type=click.Path(), help="Output file (.mcap)."
)
@click.option(
    "--duration",
    metavar="SECONDS",
    type=click.FloatRange(min=0, min_open=True),
    help="Stop after this time.  [default: Ctrl-C stops]",
)
def command(**arguments: Any) -> bool:
    """Record topics of a robot into an MCAP file.

    ADDRESS is `dds`, or the endpoint of the robot's Zenoh router, such as tcp/robot:7447. Without
    TOPIC, idlc records all topics except the topics of actions, and adds topics that appear later.
    The file contains the definitions of all types. `idlc columns`, rosbag2 and Foxglove can read
    it.
    """
    from idlc.cli.run.robots import record

    return record(**arguments)
