"""`idlc list`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import completion, options


@click.command("list", epilog=options.example("idlc list std_msgs"))
@click.argument("packages", metavar="[PACKAGE]...", nargs=-1, shell_complete=completion.packages)
@options.scoped(options.include, options.distro)
@options.style
def command(**arguments: Any) -> None:
    """List the packages that idlc can find, or the interfaces in each PACKAGE.

    idlc searches the working folder, the -I folders and the ament prefixes. It also contains the
    standard packages of each distribution.
    """
    from idlc.cli.run.look import list_names

    return list_names(**arguments)
