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
    """Print type hashes (RIHS01), derived types of services and actions included.

    TYPE is a name such as std_msgs/msg/Header, PATH a file or folder as for `idlc gen`.
    """
    from idlc.documents.show import hashes

    for value, name in hashes(subjects, scope, report):
        sys.stdout.write(f"{value}  {name}\n")
