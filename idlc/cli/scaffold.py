"""`idlc scaffold`: the group of its commands."""

from __future__ import annotations

import click

from idlc.cli import options
from idlc.cli.app import LazyGroup
from idlc.cli.options import Command

#: Each command with its line in the overview.
COMMANDS = {
    "package": "Create a package.",
    "interface": "Create a .msg, .srv or .action file.",
    "node": "Create a node with a test, and register it in its package.",
}


#: Other words for them.
SYNONYMS = {
    **dict.fromkeys(("pkg", "project", "workspace"), "package"),
    **dict.fromkeys(("msg", "srv", "action", "message", "service", "type"), "interface"),
    **dict.fromkeys(("publisher", "subscriber", "client", "server"), "node"),
}


class Scaffold(LazyGroup):
    """The group of these commands."""

    groups = {"Commands": COMMANDS}  # noqa: RUF012 - a constant
    overview = COMMANDS
    modules = "idlc.cli.scaffold_"
    synonyms = SYNONYMS


@click.group(
    "scaffold",
    cls=Scaffold,
    epilog=options.example(
        "idlc scaffold package my_robot",
        "cd my_robot",
        "idlc scaffold interface msg Command 'string verb' 'float32 speed  # [m/s]'",
        "idlc scaffold node commander --publisher Command:command@2",
        "idlc gen",
    ),
)
def command() -> None:
    """Create packages, interfaces and nodes, and update the files that refer to them.

    A second run of the same command changes nothing.
    """


def writing(function: Command) -> Command:
    """Add the options of a command that writes files."""
    dry = click.option("--dry-run", is_flag=True, help="Write nothing; show the changes.")
    force = click.option(
        "--force", is_flag=True, help="Replace existing files that differ, and keep backups."
    )
    return dry(force(function))


def common(function: Command) -> Command:
    """Add the options of a command that writes files and knows interfaces."""
    return options.include(writing(function))
