"""`idlc scaffold`: the group of its commands."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any, TypeVar

import click

from idlc.cli import options

EPILOG = """\
Example:

\b
  idlc scaffold package my_robot
  cd my_robot
  idlc scaffold interface msg Command 'string verb' 'float32 speed  # [m/s]'
  idlc scaffold node commander --publisher Command:command@2
  idlc gen
"""

Command = TypeVar("Command", bound=Callable[..., Any])

#: Each command with its line in the overview.
COMMANDS = {
    "package": "Write a new package.",
    "interface": "Write a .msg, .srv or .action file.",
    "node": "Write a node with its test, and enter it in its package.",
}


class Scaffolds(click.Group):
    """A group that imports a command when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return the names in the order in which people need them."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """Return a command by name; this imports it."""
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = import_module(f"idlc.cli.scaffold_{cmd_name}").command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """Write the overview without importing any command."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group("scaffold", cls=Scaffolds, epilog=EPILOG)
def command() -> None:
    """Write packages, interfaces and nodes, and enter them where they belong.

    Running a command twice changes nothing the second time.
    """


def common(function: Command) -> Command:
    """Add the options that all the commands have."""
    dry = click.option("--dry-run", is_flag=True, help="Write nothing; show the difference.")
    force = click.option(
        "--force", is_flag=True, help="Replace existing files that differ, keeping copies."
    )
    return options.include(dry(force(function)))


def finish(result: Any, report: Any, hints: tuple[str, ...] = ()) -> int:
    """Show what a command did and return the exit status."""
    from idlc.cli import terminal
    from idlc.text.present import summary

    terminal.show(report, "text", sys.stderr)
    if result is None:
        sys.stderr.write(f"{summary(report)}; nothing was written\n")
        return terminal.status(report)
    if result.diff:
        sys.stdout.writelines(result.diff)
        return terminal.status(report)
    folder = "" if result.folder in ("", ".") else f"{result.folder}/"
    for done in result.done:
        if done.what != "unchanged":
            sys.stdout.write(f"{done.what} {folder}{done.path}\n")
    if all(done.what == "unchanged" for done in result.done):
        sys.stdout.write("nothing to do: everything is there\n")
    else:
        sys.stdout.writelines(f"next: {hint}\n" for hint in hints)
    return terminal.status(report)
