"""`idlc describe`."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from idlc.cli import completion, options

if TYPE_CHECKING:
    from idlc.diagnostics.report import Report
    from idlc.project.settings import Scope


@click.command("describe", epilog=options.example("idlc describe std_msgs/msg/Header"))
@click.argument(
    "subject", metavar="TYPE|PATH", type=click.Path(), shell_complete=completion.types_and_paths
)
@options.scoped(options.package, options.include, options.distro)
def command(subject: str, scope: Scope, report: Report) -> None:
    """Print the type description and the type hashes of an interface as JSON.

    ROS 2 installs files with the same format, such as Header.json.
    """
    import json

    from idlc.cli import output
    from idlc.tasks.show import describe

    content = describe(subject, scope, report)
    if content is not None:
        output.lines(json.dumps(content, indent=2) + "\n", "json", sys.stdout)
