"""`idlc router`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import options


@click.command("router", epilog=options.example("idlc router"))
@click.option(
    "--listen",
    metavar="ENDPOINT",
    multiple=True,
    default=("tcp/127.0.0.1:7447",),
    show_default="tcp/127.0.0.1:7447",
    help="Accept connections at this endpoint. `tcp/0.0.0.0:7447` admits other machines. May be "
    "repeated.",
)
@click.option(
    "--connect",
    metavar="ENDPOINT",
    multiple=True,
    help="Also connect to this router, such as `tcp/robot:7447`. May be repeated.",
)
def command(**arguments: Any) -> int:
    """Run a router for ROS 2 nodes that use Zenoh, instead of rmw_zenohd, until Ctrl-C.

    Nodes on one machine find each other through the router. Other machines can reach the router
    only if --listen admits them.
    """
    from idlc.cli.run.robots import router

    return router(**arguments)
