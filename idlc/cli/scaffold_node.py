"""`idlc scaffold node`."""

from __future__ import annotations

from collections import Counter
from typing import Any

import click

from idlc.cli import options
from idlc.cli.scaffold import common
from idlc.scaffold.roles import QOS_NAMES, ROLES

EPILOG = """\
TYPE is an interface in your package (RobotCommand) or in another package (std_msgs/String). For
--param, TYPE is bool, int, float or string. If you give no endpoints on a terminal, idlc asks for
them.

Example, within a package:

\b
  idlc scaffold node talker --publisher std_msgs/String:chatter@2 --qos latched
  idlc scaffold node listener --subscriber std_msgs/String:chatter --param verbose:bool=true
"""


class NodeCommand(click.Command):
    """A command whose --qos belongs to the endpoint before it."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Assign each quality of service to its endpoint, then parse as usual."""
        if not ctx.resilient_parsing:
            names = {role.name for role in ROLES if role.kind}
            counts: Counter[str] = Counter()
            last: tuple[str, int] | None = None
            owners = ctx.meta[_OWNERS] = []
            _, _, order = self.make_parser(ctx).parse_args(args=list(args))
            for name in (parameter.name or "" for parameter in order):
                if name in names:
                    last = (name, counts[name])
                    counts[name] += 1
                elif name == "qos":
                    if last is None:
                        raise click.UsageError("--qos must follow its endpoint", ctx)
                    owners.append(last)
        return super().parse_args(ctx, args)


#: The key of the endpoints with a --qos in the context: for each, its role and its index.
_OWNERS = "idlc.qos"


def _role_options(function: Any) -> Any:
    for role in reversed(ROLES):
        function = click.option(
            role.option,
            role.name,
            metavar=role.metavar,
            multiple=True,
            shell_complete=options.completed("endpoint") if role.kind else None,
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
    metavar="|".join(QOS_NAMES),
    multiple=True,
    shell_complete=lambda _, __, word: [name for name in QOS_NAMES if name.startswith(word)],
    help="Set the quality of service of the preceding endpoint.",
)
@click.option("--lifecycle", is_flag=True, help="Create a lifecycle node.")
@click.option(
    "--robust",
    is_flag=True,
    help="Also handle rare cases: a signal while the node starts, a goal that is replaced or "
    "cancelled, a server that does not answer. A node that calls a service or sends a goal takes "
    "the values of its fields from the command line.",
)
@common
def command(**arguments: Any) -> int:
    """Create a node in the package that contains the working folder.

    Each option from --publisher to --action-client adds an endpoint to the node.

    idlc writes the module and a test. It adds the node's command to setup.py and the dependencies
    to package.xml. It also adds the node to the launch file, unless the node only sends a request
    or a goal and then exits.
    """
    from idlc.cli.run.scaffold import new_node

    return new_node(owners=click.get_current_context().meta[_OWNERS], **arguments)


MEMBERS = (command,)
