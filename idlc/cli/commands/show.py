"""`idlc show`."""

from __future__ import annotations

import sys

import click

from idlc.cli import completion, options

FORMATS = ("text", "json", "ros2idl", "jsonschema", "mcap")

EPILOG = """\
Example:

\b
  idlc show geometry_msgs/msg/PoseStamped
"""


@click.command("show", epilog=EPILOG)
@click.argument(
    "wanted",
    metavar="TYPE|PATH",
    type=click.Path(),
    shell_complete=completion.types_and_paths,
)
@click.option(
    "--format",
    "style",
    type=click.Choice(FORMATS),
    default="text",
    show_default=True,
    help="For people, or for other tools: facts as JSON, IDL, a JSON Schema, an MCAP schema.",
)
@options.package
@options.include
def command(wanted: str, style: str, package: str | None, include: tuple[str, ...]) -> int:
    """Show an interface with the messages in it and all comments."""
    from idlc.cli import output
    from idlc.diagnostics.report import Report
    from idlc.diagnostics.visible import visible
    from idlc.disk import pyproject
    from idlc.disk.scope import scope
    from idlc.driver.show import show

    report = Report()
    settings = pyproject.load(report)
    where = scope(settings, package, include)
    texts = [] if report.had_errors else show(wanted, style, where, report)
    text = "\n".join(texts)
    if style == "text" or sys.stdout.isatty():  # other formats are for other tools
        text = "\n".join(map(visible, text.split("\n")))
    sys.stdout.write(text)
    output.show(report, "text", sys.stderr)
    output.notes(report, sys.stderr)
    return output.status(report)
