"""The list of commands; each is imported when it is asked for."""

from __future__ import annotations

import click

from idlc import __version__
from idlc.cli.exit_status import PipeClosedError
from idlc.cli.lazy_group import LazyGroup

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


#: What people type who know other tools, and what it is called here.
MEANT = {
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

    def invoke(self, ctx: click.Context) -> object:
        """Run the command that was asked for."""
        try:
            return super().invoke(ctx)
        except BrokenPipeError as error:
            raise PipeClosedError from error

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that is asked for; `help` is another way to write `--help`."""
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
    overview=COMMANDS,
    modules="idlc.cli.commands.",
    meant=MEANT,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=EPILOG,
    no_args_is_help=True,
)
@click.version_option(
    __version__, "-V", "--version", prog_name="idlc", message="%(prog)s %(version)s"
)
def app() -> None:
    """Compile ROS 2 interfaces (.msg, .srv, .action) to Python, without CMake or a compiler."""
