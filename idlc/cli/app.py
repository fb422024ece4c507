"""The list of commands; each is imported when it is invoked."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Iterable, Mapping, Sequence
from importlib import import_module
from pathlib import Path

import click

from idlc.cli.exit_status import PipeClosedError, status_of
from idlc.cli.streams import colours
from idlc.diagnostics.text import did_you_mean
from idlc.version import __version__

_EXAMPLE = re.compile("(?m)^Examples?(, [a-z ]+)?:$")
#: Quoted text in click's sentences, but not in code.
_QUOTED = re.compile("(`[^`]*`)|'([^']*)'")


class _HelpFormatter(click.HelpFormatter):
    """Colours headings and names; click removes the colours if the output has none."""

    def write_usage(self, prog: str, args: str = "", prefix: str | None = None) -> None:
        """Write the first line of the help."""
        super().write_usage(prog, args, prefix or f"{click.style('Usage:', bold=True)} ")

    def write_heading(self, heading: str) -> None:
        """Write the heading of a section."""
        self.write(f"{'':{self.current_indent}}{click.style(f'{heading}:', bold=True)}\n")

    def write_text(self, text: str) -> None:
        """Write paragraphs, and colour the heading of an example."""
        super().write_text(_EXAMPLE.sub(lambda match: click.style(match[0], bold=True), text))

    def write_dl(self, rows: Iterable[tuple[str, str]], *args: int, **widths: int) -> None:
        """Write the names and descriptions of commands or options."""
        coloured = [(click.style(name, fg="cyan"), text) for name, text in rows]
        super().write_dl(coloured, *args, **widths)


class _Context(click.Context):
    formatter_class = _HelpFormatter


class LazyGroup(click.Group):
    """Commands in groups, each with its line in the overview.

    The module of a command is `modules` with its name, or with a name in `homes` if it has several
    `MEMBERS`; `synonyms` are words of other tools with the commands that are suggested for them.
    """

    context_class = _Context
    groups: Mapping[str, Mapping[str, str]]
    overview: Mapping[str, str]
    modules: str
    homes: Mapping[str, str]
    synonyms: Mapping[str, str]

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return the names in the order in which people need them."""
        return list(self.overview)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """Return a command by name; this imports it."""
        if cmd_name not in self.overview:
            return None
        home = self.homes.get(cmd_name)
        module = import_module(f"{self.modules}{home or cmd_name}")
        commands: Sequence[click.Command] = module.MEMBERS if home else (module.command,)
        command = next(command for command in commands if command.name == cmd_name)
        command.context_class = _Context
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the invoked command; suggest one for an unknown name."""
        name = args[0]
        unknown = name not in self.overview and not name.startswith("-")
        if unknown and not ctx.resilient_parsing:
            synonym = self.synonyms.get(name.lower())
            hint = f"did you mean `{synonym}`?" if synonym else did_you_mean(name, self.overview)
            hint = hint or f"the commands are {', '.join(self.overview)}"
            raise click.UsageError(f"no such command: `{name}`; {hint}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """Write the overview without importing any command."""
        width = max(map(len, self.overview))
        for heading, commands in self.groups.items():
            with formatter.section(heading):
                formatter.write_dl([(name.ljust(width), text) for name, text in commands.items()])


#: Each command with its line in the overview, in groups.
GROUPS = {
    "Start": {
        "init": "Set up a package, library or workspace.",
        "gen": "Compile interface files into a Python package.",
        "check": "Check interface files and packages.",
        "columns": "Show recorded topics, or convert them to Parquet, Arrow or CSV.",
    },
    "Write": {
        "scaffold": "Create packages, interfaces and nodes.",
        "fmt": "Format interface files.",
    },
    "Look": {
        "show": "Show an interface, a recording or a robot.",
        "list": "List packages and types.",
        "docs": "Generate a documentation site.",
        "explain": "Explain a rule such as IDL201.",
    },
    "Versions": {
        "breaking": "Compare two versions and report breaking changes.",
        "upgrade": "Convert recordings to new versions of their types.",
    },
    "Robots": {
        "echo": "Print the messages of a robot's topic.",
        "call": "Call a service of a robot.",
        "record": "Record topics of a robot.",
        "router": "Run a Zenoh router.",
    },
    "Tools": {
        "doctor": "Check the installed programs, ROS 2 and packages.",
        "lsp": "Run the language server.",
    },
}
COMMANDS = {name: text for group in GROUPS.values() for name, text in group.items()}
#: Commands whose module contains several.
HOMES = {
    "init": "scaffold",
    **dict.fromkeys(("check", "fmt", "lsp"), "check"),
    **dict.fromkeys(("show", "list", "docs", "doctor", "explain"), "look"),
    **dict.fromkeys(("breaking", "upgrade"), "versions"),
    **dict.fromkeys(("echo", "call", "record", "router"), "robots"),
}

#: Words of other tools, with the names of the commands here.
SYNONYMS = {
    **dict.fromkeys(("generate", "compile", "build", "codegen", "make"), "gen"),
    **dict.fromkeys(("new", "create", "add"), "scaffold"),
    **dict.fromkeys(("setup", "adopt", "start"), "init"),
    **dict.fromkeys(("lint", "validate", "verify", "test"), "check"),
    **dict.fromkeys(("format", "tidy"), "fmt"),
    **dict.fromkeys(("doc", "documentation", "html", "site"), "docs"),
    **dict.fromkeys(("diff", "compare", "compat", "changes"), "breaking"),
    **dict.fromkeys(("info", "cat", "view", "print", "proto"), "show"),
    "describe": "show --format type-description",
    "hash": "show --format hash",
    **dict.fromkeys(("ls", "packages", "types", "search", "find"), "list"),
    **dict.fromkeys(("export", "convert", "extract", "parquet", "arrow", "csv", "read"), "columns"),
    **dict.fromkeys(("migrate", "rewrite", "update"), "upgrade"),
    **dict.fromkeys(("zenoh", "zenohd", "rmw_zenohd", "daemon"), "router"),
    **dict.fromkeys(("rule", "rules", "why", "codes"), "explain"),
}


class App(LazyGroup):
    """The group of all commands, which `idlc help` explains too."""

    groups = GROUPS
    overview = COMMANDS
    modules = "idlc.cli."
    homes = HOMES
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
            click.echo(ctx.get_help(), color=ctx.color)
            ctx.exit()
        return super().resolve_command(ctx, args)


EPILOG = """\
Example:

\b
  mkdir -p demo/msg
  echo 'float64 speed 0.5  # [m/s]' > demo/msg/Drive.msg
  idlc gen demo -o out/demo

To complete words with the Tab key, run the line for your shell:

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
    """Compile ROS 2 interfaces (.msg, .srv, .action) to Python, without CMake or a C++ compiler."""


def run(words: list[str]) -> int:
    """Run a command and return the exit status."""
    return status_of(lambda: _through_click(words))


def _through_click(words: list[str]) -> object:
    name = "rosidlc" if Path(sys.argv[0]).stem == "rosidlc" else "idlc"
    colour = colours(sys.stdout)
    try:
        return app.main(words, prog_name=name, standalone_mode=False, color=colour)
    except getattr(click.exceptions, "NoArgsIsHelpError", ()) as error:  # click 8.2 or later
        error.show()
        return 2
    except click.ClickException as error:
        from idlc.cli.output import usage_error

        context = getattr(error, "ctx", None)
        message, _, hint = error.format_message().partition("; ")
        if isinstance(error, click.NoSuchOption):
            similar = next(iter(error.possibilities or ()), None)
            message, hint = error.message, f"did you mean `{similar}`?" if similar else ""
        missing = error.param if isinstance(error, click.MissingParameter) else None
        if context and "address" in context.params and isinstance(missing, click.Argument):
            address = shlex.quote(context.params["address"])
            hint = f"`{name} show {address}` lists the {missing.name}s"
        command = context.command_path if context else " ".join((name, *words[:1]))
        hint = hint or f"`{command} --help` lists the arguments and options"
        if message[1:2].islower():  # click begins its sentences with a capital letter
            message = f"{message[0].lower()}{message[1:].rstrip('.')}"
        message = re.sub(
            r"got unexpected extra (arguments? )\((.*)\)", r"unexpected \1`\2`", message
        )
        usage_error(_QUOTED.sub(lambda match: match[1] or f"`{match[2]}`", message), hint)
        return 2
    except click.Abort as error:
        raise KeyboardInterrupt from error
