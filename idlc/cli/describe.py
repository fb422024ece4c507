"""`idlc describe`."""

from __future__ import annotations

import sys

import click

from idlc.cli import completion, options

EPILOG = """\
Example:

\b
  idlc describe std_msgs/msg/Header
"""


@click.command("describe", epilog=EPILOG)
@click.argument(
    "subject",
    metavar="TYPE|PATH",
    type=click.Path(),
    shell_complete=completion.types_and_paths,
)
@options.package
@options.include
@options.distro
def command(subject: str, package: str | None, include: tuple[str, ...], distro: str | None) -> int:
    """Print a type description with its hashes: the JSON that ROS 2 installs."""
    import json

    from idlc.cli import output
    from idlc.diagnostics.report import Report
    from idlc.documents.show import describe
    from idlc.project.root import Root
    from idlc.project.settings import load_settings, scope

    report = Report()
    settings = load_settings(Root.here(), report)
    where = scope(settings, package, include, distro=distro)
    content = None if report.had_errors else describe(subject, where, report)
    if content is not None:
        sys.stdout.write(json.dumps(content, indent=2) + "\n")
    output.show(report, "text", sys.stderr)
    output.notes(report, sys.stderr)
    return output.status(report)
