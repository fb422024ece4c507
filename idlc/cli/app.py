"""The list of commands; each is imported when it is invoked."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

import click

from idlc.cli.exit_status import PipeClosedError, status_of
from idlc.version import __version__


class LazyGroup(click.Group):
    """A group of commands, each with its line in the overview.

    The module of a command is `modules` with its name; `synonyms` are words of other tools with
    the commands that are suggested for them.
    """

    overview: Mapping[str, str]
    modules: str
    synonyms: Mapping[str, str]

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return the names in the order in which people need them."""
        return list(self.overview)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """Return a command by name; this imports it."""
        if cmd_name not in self.overview:
            return None
        command: click.Command = import_module(f"{self.modules}{cmd_name}").command
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the invoked command; suggest one for an unknown name."""
        name = args[0]
        unknown = name not in self.overview and not name.startswith("-")
        if unknown and not ctx.resilient_parsing:
            from idlc.diagnostics.text import did_you_mean

            synonym = self.synonyms.get(name.lower())
            hint = f"did you mean `{synonym}`?" if synonym else did_you_mean(name, self.overview)
            hint = hint or f"the commands are {', '.join(self.overview)}"
            raise click.UsageError(f"no such command: {name!r}; {hint}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """Write the overview without importing any command."""
        with formatter.section("Commands"):
            formatter.write_dl(list(self.overview.items()))


#: Each command with its line in the overview; its module is `idlc.cli.<name>`.
COMMANDS = {
    "gen": "Compile interface files into a Python package.",
    "check": "Report every problem of interface files.",
    "breaking": "Report what breaks against another version.",
    "fmt": "Lay interface files out.",
    "hash": "Print type hashes (RIHS01).",
    "show": "Show an interface with the messages in it.",
    "columns": "Write topics of a recording as Parquet, Arrow or CSV.",
    "list": "List the packages and types that are known here.",
    "docs": "Write a site about interfaces.",
    "lsp": "Serve an editor.",
    "describe": "Print a type description, as ROS 2 installs it.",
    "scaffold": "Write packages, interfaces and nodes.",
    "explain": "Explain a code such as IDL201.",
}


#: Words of other tools, with the names of the commands here.
SYNONYMS = {
    **dict.fromkeys(("generate", "compile", "build", "codegen", "make"), "gen"),
    **dict.fromkeys(("new", "create", "init", "add"), "scaffold"),
    **dict.fromkeys(("lint", "validate", "verify", "test"), "check"),
    **dict.fromkeys(("format", "tidy"), "fmt"),
    **dict.fromkeys(("doc", "documentation", "html", "site"), "docs"),
    **dict.fromkeys(("diff", "compare", "compat", "changes"), "breaking"),
    **dict.fromkeys(("info", "cat", "view", "print", "proto"), "show"),
    **dict.fromkeys(("ls", "packages", "types", "search", "find"), "list"),
    **dict.fromkeys(("export", "convert", "extract", "parquet", "arrow", "csv", "read"), "columns"),
    **dict.fromkeys(("rule", "rules", "why", "codes"), "explain"),
}


class App(LazyGroup):
    """The group of all commands, which `idlc help` explains too."""

    overview = COMMANDS
    modules = "idlc.cli."
    synonyms = SYNONYMS

    def invoke(self, ctx: click.Context) -> object:
        """Run the invoked command."""
        try:
            return super().invoke(ctx)
        except BrokenPipeError as error:
            raise PipeClosedError from error

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the invoked command; `help` is another way to write `--help`."""
        if args[0] == "help" and len(args) > 1:
            args = [*args[1:], *([] if ctx.resilient_parsing else ["--help"])]
        elif args[0] == "help" and not ctx.resilient_parsing:
            click.echo(ctx.get_help())
            ctx.exit()
        return super().resolve_command(ctx, args)


EPILOG = """\
Example:

\b
  mkdir -p demo/msg
  echo 'float64 speed 0.5  # [m/s]' > demo/msg/Drive.msg
  idlc gen demo -o out/demo

Completion of commands, options, types and codes, for bash, zsh and fish:

\b
  eval "$(_IDLC_COMPLETE=bash_source idlc)"
  eval "$(_IDLC_COMPLETE=zsh_source idlc)"
  _IDLC_COMPLETE=fish_source idlc | source
"""


@click.group(
    cls=App,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=EPILOG,
    no_args_is_help=True,
)
@click.version_option(
    __version__, "-V", "--version", prog_name="idlc", message="%(prog)s %(version)s"
)
def app() -> None:
    """Compile ROS 2 interfaces (.msg, .srv, .action) to Python, without CMake or a compiler."""


def run(words: list[str]) -> int:
    """Run a command and return the exit status."""
    return status_of(lambda: _through_click(words))


def _through_click(words: list[str]) -> object:
    name = "rosidlc" if Path(sys.argv[0]).stem == "rosidlc" else "idlc"
    try:
        return app.main(words, prog_name=name, standalone_mode=False)
    except click.ClickException as error:
        error.show()
        return 2
    except click.Abort as error:
        raise KeyboardInterrupt from error
