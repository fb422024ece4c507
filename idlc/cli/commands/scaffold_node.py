"""`idlc scaffold node`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from idlc.cli import completion
from idlc.cli.commands.scaffold import common, finish

EPILOG = """\
TYPE is an interface of your own package (RobotCommand) or any other (std_msgs/String). An
endpoint can be followed by its --qos. Without options, on a terminal, you are asked.

Example, within a package:

\b
  idlc scaffold node talker --publisher std_msgs/String:chatter@2 --qos latched
  idlc scaffold node listener --subscriber std_msgs/String:chatter --param verbose:bool=true
"""
QOS = ("default", "sensor_data", "latched")
_ENDPOINTS = {
    "publisher": ("TYPE:TOPIC[@HZ]", "Publish, by default once a second."),
    "subscriber": ("TYPE:TOPIC", "Receive messages."),
    "service": ("TYPE:NAME", "Answer requests."),
    "client": ("TYPE:NAME", "Call a service; the request's fields come from the command line."),
    "action-server": ("TYPE:NAME", "Work on goals, which can be cancelled and replaced."),
    "action-client": ("TYPE:NAME", "Send a goal; its fields come from the command line."),
}
_MARK = "\0qos="


def interactive() -> bool:
    """Return whether there is somebody to ask."""
    return sys.stdin.isatty() and sys.stdout.isatty()


class NodeCommand(click.Command):
    """A command whose --qos belongs to the endpoint before it."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Attach each quality of service to its endpoint, then go on as usual."""
        return super().parse_args(ctx, args if ctx.resilient_parsing else _attached(args, ctx))


def _attached(args: list[str], ctx: click.Context) -> list[str]:
    words: list[str] = []
    endpoint: int | None = None
    waiting = iter(args)
    for word in waiting:
        name, equals, value = word.partition("=")
        if name == "--qos":
            value = value if equals else next(waiting, "")
            if value not in QOS:
                raise click.UsageError(f"--qos is one of {', '.join(QOS)}, not {value!r}", ctx)
            if endpoint is None:
                raise click.UsageError("--qos comes after the endpoint that it is for", ctx)
            words[endpoint] += f"{_MARK}{value}"
        elif name.removeprefix("--") in _ENDPOINTS and name.startswith("--"):
            words.append(word)
            if not equals:
                words += [following] if (following := next(waiting, None)) is not None else []
            endpoint = len(words) - 1
        else:
            words.append(word)
    return words


def _endpoint_options(function: Any) -> Any:
    for name, (metavar, text) in reversed(_ENDPOINTS.items()):
        function = click.option(
            f"--{name}",
            name.replace("-", "_"),
            metavar=metavar,
            multiple=True,
            shell_complete=completion.endpoint,
            help=text,
        )(function)
    return function


@click.command("node", cls=NodeCommand, epilog=EPILOG)
@click.argument("name", metavar="NAME")
@_endpoint_options
@click.option("--timer", "timers", metavar="SECONDS", multiple=True, help="Do something regularly.")
@click.option(
    "--param", "parameters", metavar="NAME:TYPE=DEFAULT", multiple=True, help="Declare a parameter."
)
@click.option(
    "--qos",
    metavar="|".join(QOS),
    shell_complete=lambda _, __, word: [one for one in QOS if one.startswith(word)],
    help="The quality of service of the endpoint before.",
)
@click.option("--lifecycle", is_flag=True, help="Make it a managed node, with states.")
@click.option("--launch/--no-launch", default=True, help="Enter it in the launch file, or not.")
@common
def command(name: str, qos: str | None, lifecycle: bool, launch: bool, **given: Any) -> int:  # noqa: ARG001
    """Write a node of the package that the working folder belongs to.

    Writes the module and its test, and adds the command to setup.py, the packages that it needs
    to package.xml and the node to the launch file, unless it does one thing and ends.
    """
    from idlc.diagnostics.report import Report
    from idlc.driver import scaffold, scaffold_node
    from idlc.scaffold import spec

    settings = scaffold.Settings(given["dry_run"], given["force"], given["include"], launch)
    asked = any(given[key.replace("-", "_")] for key in _ENDPOINTS)
    asked = asked or given["timers"] or given["parameters"] or lifecycle
    try:
        spec.check_name(name)
        if not asked and interactive():
            from idlc.cli.wizard import ask

            wanted = ask(name, lambda role, type_: scaffold_node.check_type(role, type_, settings))
        else:
            wanted = spec.Node(
                name,
                "",
                tuple(spec.endpoint(role, one) for role in spec.ROLES for one in given[role]),
                tuple(map(spec.period, given["timers"])),
                tuple(map(spec.parameter, given["parameters"])),
                lifecycle,
            )
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    report = Report()
    result = scaffold_node.node(wanted, settings, report)
    folder = "" if result is None or result.folder == "." else f"{result.folder}/"
    test = f"{Path(sys.executable).name} -m pytest {folder}test/test_{name}.py"
    return finish(result, report, (test,))
