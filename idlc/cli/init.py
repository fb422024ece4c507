"""`idlc init`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import options


@click.command(
    "init",
    epilog=options.example("mkdir my_robot", "idlc init my_robot --yes"),
)
@click.argument("path", metavar="[PATH]", default=".", type=click.Path())
@click.option(
    "--ci",
    "service",
    type=click.Choice(["github", "gitlab", "pre-commit"]),
    help="Also write the configuration file with which GitHub, GitLab or pre-commit checks the "
    "interfaces.",
)
@click.option("--yes", is_flag=True, help="Write without asking, and always test.")
def command(**arguments: Any) -> int:
    """Set up ROS 2 interfaces in a package, library or workspace.

    PATH is a ROS 2 package (ament_python or ament_cmake), a Python library with any build backend,
    a workspace of packages, or an empty folder. In an empty folder, idlc creates the
    package that `idlc scaffold package` creates, with an example.

    idlc shows every change first. On a terminal, it asks before it writes; elsewhere, it writes
    only with --yes. It then compiles the interfaces, installs a copy of the package into a
    temporary folder, and imports the classes from that folder. The installation runs the package's
    own build.

    If there is nothing to change, idlc does not test the package again unless you add --yes.
    """
    from idlc.cli.run.init import run

    return run(**arguments)
