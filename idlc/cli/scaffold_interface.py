"""`idlc scaffold interface`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import options
from idlc.cli.scaffold import common

EPILOG = options.example(
    "idlc scaffold interface msg RobotCommand \\",
    "    'string command_type' 'float32 linear_velocity_x  # [m/s]'",
    "idlc scaffold interface srv AddTwoInts 'int64 a' 'int64 b' --- 'int64 sum'",
    title="Example, within a package",
)


@click.command("interface", epilog=EPILOG, context_settings={"ignore_unknown_options": True})
@click.argument("kind", type=click.Choice(["msg", "srv", "action"]))
@click.argument("name", metavar="NAME")
@click.argument("fields", metavar="FIELD...", nargs=-1, type=click.UNPROCESSED)
@common
def command(**arguments: Any) -> int:
    """Create an interface in the package that contains the working folder.

    FIELD is a line of the file, such as 'float32 speed 0.5  # [m/s]', a constant or a comment.
    `---` separates the sections of services and actions.
    """
    from idlc.cli.run.scaffold import new_interface

    return new_interface(**arguments)
