"""`idlc router`."""

from __future__ import annotations

import sys

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
def command(listen: tuple[str, ...], connect: tuple[str, ...]) -> int:
    """Run a router for ROS 2 nodes that use Zenoh, instead of rmw_zenohd, until Ctrl-C.

    Nodes on one machine find each other through the router. Other machines can reach the router
    only if --listen admits them.
    """
    from idlc.cli import output
    from idlc.cli.streams import stop_signals
    from idlc.robot.errors import RobotError
    from idlc.robot.session import open_router

    try:
        with stop_signals() as stopped, open_router(listen, connect):
            sys.stdout.write(f"listening on {', '.join(listen)}; press Ctrl-C to stop\n")
            sys.stdout.flush()
            while not stopped.wait(0.5):  # on Windows, a wait without an end is not interrupted
                pass
    except RobotError as error:
        output.usage_error(error.message, error.hint or "")
        return 2
    return 0
