"""Commands for a running robot: `call`, `echo`, `record` and `router`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import options


@click.command(
    "call", epilog=options.example("idlc call tcp/robot:7447 /add_two_ints a=1 b=2 --format json")
)
@options.on_robot
@click.argument("service", metavar="SERVICE", shell_complete=options.completed("robot_names"))
@click.argument(
    "values", metavar="[FIELD=VALUE]...", nargs=-1, shell_complete=options.completed("robot_fields")
)
@click.option(
    "--timeout",
    metavar="SECONDS",
    type=click.FloatRange(min=0, min_open=True),
    default=10.0,
    show_default=True,
    help="Stop waiting for the response after this time.",
)
@options.output_style(("yaml", "json"), "Output format: YAML, or one JSON object.")
def call_command(**arguments: Any) -> None:
    """Call a service of a robot and print the response.

    ADDRESS is `dds` for robots that use DDS, or the endpoint of a Zenoh router, such as
    tcp/robot:7447.
    FIELD=VALUE sets a field of the request: write `goal.x=1.5`, for example. Write lists and
    messages as JSON, such as `ids=[1,2]`. Other fields have their default values. idlc checks all
    values before it sends the request.
    """
    from idlc.cli.run.robots import call

    return call(**arguments)


@click.command(
    "echo",
    epilog=options.example(
        "idlc echo tcp/robot:7447 /odom",
        "idlc echo tcp/robot:7447 /odom --fields pose.pose.position",
        "idlc echo tcp/robot:7447 /odom --count 100 --format csv > odom.csv",
    ),
)
@options.on_robot
@click.argument("topic", metavar="TOPIC", shell_complete=options.completed("robot_names"))
@click.option(
    "--count",
    metavar="N",
    type=click.IntRange(min=1),
    help="Stop after this number of messages.  [default: Ctrl-C stops]",
)
@click.option(
    "--fields",
    metavar="FIELD,...",
    help="Print only these fields, such as `header.stamp,position[0]`. `position.elbow` is the "
    "element that the message names `elbow`.",
)
@options.output_style(
    ("yaml", "json", "csv"), "Output format: YAML documents, one JSON object per line, or CSV."
)
def echo_command(**arguments: Any) -> None:
    """Print the messages of a robot's topic as they arrive.

    ADDRESS is `dds` for robots that use DDS, or the endpoint of a Zenoh router, such as
    tcp/robot:7447. To use a Zenoh configuration file instead, write zenoh:FILE. The variable
    ROS_DOMAIN_ID selects the domain. idlc needs no interface files, because the robot's nodes send
    the definition of the type.

    In CSV, each list is written as JSON. In JSON, numbers that are not finite are null. On a
    terminal, YAML shows the first 16 elements of an array that has more than 32.
    """
    from idlc.cli.run.robots import echo

    return echo(**arguments)


@click.command(
    "record",
    epilog=options.example(
        "idlc record tcp/robot:7447 -o drive.mcap /odom /scan --duration 60",
        "idlc columns drive.mcap /odom",
    ),
)
@options.on_robot
@click.argument(
    "topics", metavar="[TOPIC]...", nargs=-1, shell_complete=options.completed("robot_names")
)
@click.option(
    "-o", "--out", metavar="FILE", required=True, type=click.Path(), help="Output file (.mcap)."
)
@click.option(
    "--duration",
    metavar="SECONDS",
    type=click.FloatRange(min=0, min_open=True),
    help="Stop after this time.  [default: Ctrl-C stops]",
)
def record_command(**arguments: Any) -> bool:
    """Record topics of a robot into an MCAP file.

    ADDRESS is `dds` for robots that use DDS, or the endpoint of a Zenoh router, such as
    tcp/robot:7447. Without TOPIC, idlc records all topics except the topics of actions, and adds
    topics that appear later. The file contains the definitions of all types. `idlc columns`,
    rosbag2 and Foxglove can read it.
    """
    from idlc.cli.run.robots import record

    return record(**arguments)


@click.command("router", epilog=options.example("idlc router"))
@click.argument("connect", metavar="[ADDRESS]...", nargs=-1)
@click.option(
    "--listen",
    metavar="ENDPOINT",
    multiple=True,
    default=("tcp/127.0.0.1:7447",),
    show_default=True,
    help="Accept connections at this endpoint. With `tcp/0.0.0.0:7447`, other machines "
    "can connect. Repeatable.",
)
def router_command(**arguments: Any) -> int:
    """Run a Zenoh router for ROS 2 nodes. It replaces rmw_zenohd. Ctrl-C stops it.

    ADDRESS is another router to connect to, such as tcp/robot:7447.

    Nodes on one machine find each other through the router. Other machines can reach the router
    only with --listen.
    """
    from idlc.cli.run.robots import router

    return router(**arguments)


MEMBERS = (call_command, echo_command, record_command, router_command)
