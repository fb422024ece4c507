"""`idlc robot`: the group of its commands."""

from __future__ import annotations

import click

from idlc.cli import options
from idlc.cli.app import LazyGroup


class Robot(LazyGroup):
    """The group of these commands, each with its line in the overview."""

    overview = {"router": "Run a router for ROS 2 nodes that use Zenoh."}  # noqa: RUF012 - a constant
    modules = "idlc.cli.robot_"
    synonyms = dict.fromkeys(("daemon", "rmw_zenohd", "zenohd"), "router")


@click.group("robot", cls=Robot, epilog=options.example("idlc robot router"))
def command() -> None:
    """Connect programs without ROS to each other and to robots.

    These commands speak the protocol of rmw_zenoh and need `idlc[zenoh]`.
    """
