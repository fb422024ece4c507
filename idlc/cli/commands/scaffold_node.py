"""`idlc scaffold node`."""

from __future__ import annotations

import sys
from collections import Counter
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import click

from idlc.cli import completion
from idlc.cli.commands.scaffold import common, finish
from idlc.scaffold import qos, spec
from idlc.scaffold.roles import ROLES

EPILOG = """\
TYPE is an interface of your own package (RobotCommand) or any other (std_msgs/String). An
endpoint can be followed by its --qos. Without options, on a terminal, you are asked.

Example, within a package:

\b
  idlc scaffold node talker --publisher std_msgs/String:chatter@2 --qos latched
  idlc scaffold node listener --subscriber std_msgs/String:chatter --param verbose:bool=true
"""


def interactive() -> bool:
    """Return whether there is somebody to ask."""
    return sys.stdin.isatty() and sys.stdout.isatty()


class NodeCommand(click.Command):
    """A command whose --qos belongs to the endpoint before it."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Note to which endpoint each quality of service belongs, then go on as usual."""
        if not ctx.resilient_parsing:
            _, _, order = self.make_parser(ctx).parse_args(args=list(args))
            ctx.meta[_OWNERS] = _owners([one.name or "" for one in order], ctx)
        return super().parse_args(ctx, args)


#: Where the endpoints that have a --qos are kept: for each, its role and its place in that.
_OWNERS = "idlc.qos"


def _owners(order: list[str], ctx: click.Context) -> list[tuple[str, int]]:
    """Return which endpoint each --qos comes after; `order` names the options as given."""
    names = {role.name for role in ROLES if role.kind}
    counts: Counter[str] = Counter()
    last: tuple[str, int] | None = None
    owners = []
    for name in order:
        if name in names:
            last = (name, counts[name])
            counts[name] += 1
        elif name == "qos":
            if last is None:
                raise click.UsageError("--qos comes after the endpoint that it is for", ctx)
            owners.append(last)
    return owners


def _role_options(function: Any) -> Any:
    for role in reversed(ROLES):
        function = click.option(
            role.option,
            role.name,
            metavar=role.metavar,
            multiple=True,
            shell_complete=completion.endpoint if role.kind else None,
            help=role.help,
        )(function)
    return function


@click.command("node", cls=NodeCommand, epilog=EPILOG)
@click.argument("name", metavar="NAME")
@_role_options
@click.option(
    "--param", "parameters", metavar="NAME:TYPE=DEFAULT", multiple=True, help="Declare a parameter."
)
@click.option(
    "--qos",
    "qos",
    metavar="|".join(qos.NAMES),
    multiple=True,
    shell_complete=lambda _, __, word: [one for one in qos.NAMES if one.startswith(word)],
    help="The quality of service of the endpoint before it.",
)
@click.option("--lifecycle", is_flag=True, help="Make it a managed node, with states.")
@click.option("--launch/--no-launch", default=True, help="Enter it in the launch file, or not.")
@common
def command(name: str, **given: Any) -> int:
    """Write a node of the package that the working folder belongs to.

    Writes the module and its test, and adds the command to setup.py, the packages that it needs
    to package.xml and the node to the launch file, unless it does one thing and ends.
    """
    from idlc.diagnostics.report import Report
    from idlc.driver.scaffold import node as scaffold_node
    from idlc.driver.scaffold import types as scaffold_types
    from idlc.driver.scaffold.changes import Settings

    shared = ("dry_run", "force", "include", "templates", "launch")
    settings = Settings(**{key: given[key] for key in shared})
    asked = any(given[role.name] for role in ROLES) or given["parameters"] or given["lifecycle"]
    try:
        spec.check_name(name)
        if not asked and interactive():
            from idlc.cli.wizard import ask

            wanted = ask(name, lambda role, type_: scaffold_types.check(role, type_, settings))
        else:
            owners = click.get_current_context().meta[_OWNERS]
            wanted = _wanted(name, given, dict(zip(owners, given["qos"], strict=True)))
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    report = Report()
    result = scaffold_node.node(wanted, settings, report)
    folder = "" if result is None or result.folder == "." else f"{result.folder}/"
    python = Path(sys.executable).name
    install = () if find_spec("pytest") else (f"{python} -m pip install pytest",)
    test = f"{python} -m pytest {folder}test/test_{name}.py"
    return finish(result, report, (*install, test))


def _wanted(name: str, given: dict[str, Any], presets: dict[tuple[str, int], str]) -> spec.Node:
    """Return the node that the command line describes."""
    endpoints = (
        spec.endpoint(role, value, presets.get((role.name, n)))
        for role in ROLES
        for n, value in enumerate(given[role.name])
    )
    parameters = tuple(map(spec.parameter, given["parameters"]))
    return spec.Node(name, "", tuple(endpoints), parameters, given["lifecycle"])
