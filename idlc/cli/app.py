"""The list of commands; each is imported when it is asked for."""

from __future__ import annotations

from importlib import import_module

import click

from idlc import __version__
from idlc.cli.ending import PipeClosedError

#: Each command with its line in the overview; its module is `idlc.cli.<name>`.
COMMANDS = {
    "gen": "Compile interface files into a Python package.",
    "check": "Report every problem of interface files.",
    "breaking": "Report what breaks against another version.",
    "fmt": "Lay interface files out.",
    "hash": "Print type hashes (RIHS01).",
    "show": "Show an interface with the messages in it.",
    "docs": "Write a site about interfaces.",
    "describe": "Print a type description, as ROS 2 installs it.",
    "scaffold": "Write packages, interfaces and nodes.",
    "explain": "Explain a code such as IDL201.",
}


class LazyGroup(click.Group):
    """A group that knows its commands by name only."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return the names in the order in which people need them."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """Return a command by name; this imports it."""
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = import_module(f"idlc.cli.{cmd_name}").command
        return command

    def invoke(self, ctx: click.Context) -> object:
        """Run the command that was asked for."""
        try:
            return super().invoke(ctx)
        except BrokenPipeError as error:
            raise PipeClosedError from error

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that is asked for; suggest one for a name that there is not."""
        name = args[0]
        if name not in COMMANDS and not name.startswith("-"):
            from idlc.text.suggest import did_you_mean

            hint = did_you_mean(name, COMMANDS) or f"the commands are {', '.join(COMMANDS)}"
            raise click.UsageError(f"no such command: {name!r}; {hint}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """Write the overview without importing any command."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


EPILOG = """\
Example:

\b
  mkdir -p demo/msg
  echo 'float64 speed 0.5  # [m/s]' > demo/msg/Drive.msg
  idlc gen demo -o out/demo

Completion in bash:

\b
  eval "$(_IDLC_COMPLETE=bash_source idlc)"
"""


@click.group(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=EPILOG,
    no_args_is_help=True,
)
@click.version_option(
    __version__, "-V", "--version", prog_name="idlc", message="%(prog)s %(version)s"
)
def app() -> None:
    """Compile ROS 2 interfaces (.msg, .srv, .action) to Python, without CMake or a compiler."""
