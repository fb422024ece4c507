"""`idlc call`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import completion, options


@click.command(
    "call", epilog=options.example("idlc call tcp/robot:7447 /add_two_ints a=1 b=2 --format json")
)
@options.on_robot
@click.argument("service", metavar="SERVICE", shell_complete=completion.robot_names)
@click.argument(
    "values", metavar="[FIELD=VALUE]...", nargs=-1, shell_complete=completion.robot_fields
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
def command(**arguments: Any) -> None:
    """Call a service of a robot and print the response.

    ADDRESS is `dds`, or the endpoint of the robot's Zenoh router, such as tcp/robot:7447.
    FIELD=VALUE sets a field of the request: write `goal.x=1.5`, for example. Write lists and
    messages as JSON, such as `ids=[1,2]`. Other fields have their default values. idlc checks all
    values before it sends the request.
    """
    from idlc.cli.run.robots import call

    return call(**arguments)
