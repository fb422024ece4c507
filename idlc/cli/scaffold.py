"""Commands that write packages: `init`, and `scaffold` with `package` and `interface`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import options
from idlc.cli.app import LazyGroup
from idlc.cli.options import Command


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
def init_command(**arguments: Any) -> int:
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


#: Each command with its line in the overview.
COMMANDS = {
    "package": "Create a package.",
    "interface": "Create a .msg, .srv or .action file.",
    "node": "Create a node with a test, and register it in its package.",
}


#: Other words for them.
SYNONYMS = {
    **dict.fromkeys(("pkg", "project", "workspace"), "package"),
    **dict.fromkeys(("msg", "srv", "action", "message", "service", "type"), "interface"),
    **dict.fromkeys(("publisher", "subscriber", "client", "server"), "node"),
}


HOMES = {"package": "scaffold", "interface": "scaffold", "node": "scaffold_node"}


class Scaffold(LazyGroup):
    """The group of these commands."""

    groups = {"Commands": COMMANDS}  # noqa: RUF012 - a constant
    overview = COMMANDS
    modules = "idlc.cli."
    homes = HOMES
    synonyms = SYNONYMS


@click.group(
    "scaffold",
    cls=Scaffold,
    epilog=options.example(
        "idlc scaffold package my_robot",
        "cd my_robot",
        "idlc scaffold interface msg Command 'string verb' 'float32 speed  # [m/s]'",
        "idlc scaffold node commander --publisher Command:command@2",
        "idlc gen",
    ),
)
def command() -> None:
    """Create packages, interfaces and nodes, and update the files that refer to them.

    A second run of the same command changes nothing.
    """


def writing(function: Command) -> Command:
    """Add the options of a command that writes files."""
    diff = click.option("--diff", "dry_run", is_flag=True, help="Write nothing; show the changes.")
    force = click.option(
        "--force", is_flag=True, help="Replace existing files that differ, and keep backups."
    )
    return diff(force(function))


def common(function: Command) -> Command:
    """Add the options of a command that writes files and knows interfaces."""
    return options.include(writing(function))


PACKAGE_EPILOG = options.example(
    "idlc scaffold package my_robot --maintainer 'Ada <ada@example.com>'",
    "idlc scaffold package --interfaces my_msgs Drive srv/Ask",
    title="Examples",
)


LICENSES = ("Apache-2.0", "BSD-3-Clause", "MIT")


@click.command("package", epilog=PACKAGE_EPILOG)
@click.argument("name", metavar="NAME")
@click.argument("starters", metavar="[INTERFACE]...", nargs=-1)
@click.option(
    "--maintainer",
    metavar="'NAME <EMAIL>'",
    default="",
    help="Maintainer of the package.  [default: git's user.name and user.email]",
)
@click.option(
    "--license",
    "licence",
    type=click.Choice(LICENSES),
    help="License of the package.  [default: Apache-2.0]",
)
@click.option(
    "--interfaces",
    "interfaces_only",
    is_flag=True,
    help="Create a package that contains only interfaces. CMake builds it for nodes in any "
    "language, and pip builds it for Python.",
)
@common
def package_command(**arguments: Any) -> int:
    """Create a package that you can build with colcon and install with pip.

    INTERFACE is an interface to create, such as `Drive` or `srv/Ask`, and needs --interfaces.

    Each build of the package compiles the interfaces in its msg/, srv/ and action/ folders.
    `idlc init` creates the same package in an empty folder, with an example, and compiles it.
    """
    from idlc.cli.run.scaffold import new_package

    return new_package(**arguments)


INTERFACE_EPILOG = options.example(
    "idlc scaffold interface msg RobotCommand \\",
    "    'string command_type' 'float32 linear_velocity_x  # [m/s]'",
    "idlc scaffold interface srv AddTwoInts 'int64 a' 'int64 b' --- 'int64 sum'",
    title="Example, within a package",
)


@click.command(
    "interface", epilog=INTERFACE_EPILOG, context_settings={"ignore_unknown_options": True}
)
@click.argument("kind", type=click.Choice(["msg", "srv", "action"]))
@click.argument("name", metavar="NAME")
@click.argument("fields", metavar="FIELD...", nargs=-1, type=click.UNPROCESSED)
@common
def interface_command(**arguments: Any) -> int:
    """Create an interface in the package that contains the working folder.

    FIELD is a line of the file, such as 'float32 speed 0.5  # [m/s]', a constant or a comment.
    `---` separates the sections of services and actions.
    """
    from idlc.cli.run.scaffold import new_interface

    return new_interface(**arguments)


MEMBERS = (init_command, package_command, interface_command)
