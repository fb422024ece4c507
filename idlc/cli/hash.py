"""`idlc hash`."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from idlc.cli import completion, options

if TYPE_CHECKING:
    from idlc.diagnostics.report import Report
    from idlc.project.settings import Scope


@click.command("hash", epilog=options.example("idlc hash std_msgs/msg/Header std_srvs/srv/SetBool"))
@click.argument(
    "subjects",
    metavar="PATH|TYPE...",
    nargs=-1,
    required=True,
    type=click.Path(),
    shell_complete=completion.types_and_paths,
)
@options.scoped(options.package, options.include, options.exclude, options.distro)
def command(subjects: tuple[str, ...], scope: Scope, report: Report) -> None:
    """Print the type hashes (RIHS01) of interfaces.

    For a service or action, idlc also prints the hashes of the messages that ROS 2 derives from it.

    TYPE is a name such as std_msgs/msg/Header. PATH is a file or folder, as in `idlc gen`.
    """
    from idlc.cli import output
    from idlc.tasks.show import hashes

    paint = output.painter(sys.stdout)
    for value, name in hashes(subjects, scope, report):
        sys.stdout.write(f"{paint('value', value)}  {name}\n")
