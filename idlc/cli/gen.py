"""`idlc gen`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import options

EPILOG = options.example(*options.DEMO, "idlc gen demo -o out/demo")


class _Command(click.Command):
    """The command, in which --vendor-deps does not take the next argument for its value."""

    def parse_args(self, context: click.Context, words: list[str]) -> list[str]:
        """Parse the words after the command."""
        words = [f"{word}=private" if word == "--vendor-deps" else word for word in words]
        return super().parse_args(context, words)


@click.command("gen", cls=_Command, epilog=EPILOG)
@click.argument(
    "paths",
    metavar="[PATH|PACKAGE|TYPE|REC]...",
    nargs=-1,
    type=click.Path(),
    shell_complete=options.completed("topics_and_paths"),
)
@click.option(
    "-o",
    "--out",
    metavar="OUT",
    type=click.Path(),
    help="Output folder.  [default: `out` in pyproject.toml]",
)
@click.option(
    "--ament",
    metavar="PREFIX",
    type=click.Path(),
    default="",
    help="Install into the folder PREFIX, for ROS 2's tools.",
)
@options.packages
@options.distro
@click.option("--check", is_flag=True, help="Write nothing; fail if OUT is out of date.")
@click.option("--watch", is_flag=True, help="Compile again after every change.")
@click.option(
    "--vendor-deps",
    "vendoring",
    type=click.Choice(("private", "beside")),
    is_flag=False,
    flag_value="private",
    metavar="",
    help="Also compile the types of other packages that your package uses.",
)
@click.option(
    "--force",
    is_flag=True,
    help="Also replace files that idlc did not write, and keep backups.",
)
@options.report_style
def command(**arguments: Any) -> int:
    """Compile interface files into a Python package.

    PATH is a file or folder, PACKAGE and TYPE are names such as std_msgs and std_msgs/msg/Header,
    and REC is a recording (`drive.mcap /odom` selects a topic). idlc writes the package to the
    folder OUT, or several packages to OUT/NAME. Without arguments, it compiles the package in the
    working folder.

    After `idlc gen --ament PREFIX`, ROS 2 finds the packages if you source PREFIX/setup.bash.
    """
    from idlc.cli.run.gen import run

    return run(**arguments)
