"""`idlc scaffold package`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import options
from idlc.cli.scaffold import common

EPILOG = options.example(
    "idlc scaffold package my_robot --maintainer 'Ada' --email ada@example.com",
    "idlc scaffold package --interfaces my_msgs Drive srv/Ask",
    title="Examples",
)


LICENSES = ("Apache-2.0", "BSD-3-Clause", "MIT")


@click.command("package", epilog=EPILOG)
@click.argument("name", metavar="NAME")
@click.argument("starters", metavar="[INTERFACE]...", nargs=-1)
@click.option("--description", default="", help="Description of the package, in one sentence.")
@click.option("--maintainer", help="Name of the maintainer.  [default: git's user.name]")
@click.option("--email", help="Email address of the maintainer.  [default: git's user.email]")
@click.option("--license", "licence", type=click.Choice(LICENSES), help="License of the package.")
@click.option(
    "--interfaces",
    "--interfaces-only",
    "interfaces_only",
    is_flag=True,
    help="Create a package that contains only interfaces. CMake builds it for nodes in any "
    "language, and pip builds it for Python. INTERFACE is an interface to create, such as "
    "`Drive` or `srv/Ask`.",
)
@common
def command(**arguments: Any) -> int:
    """Create a package that you can build with colcon and install with pip.

    Each build of the package compiles the interfaces in its msg/, srv/ and action/ folders.
    `idlc init` creates the same package in an empty folder, with an example, and compiles it.
    """
    from idlc.cli.run.scaffold import new_package

    return new_package(**arguments)
