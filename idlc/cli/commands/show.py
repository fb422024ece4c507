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
    metavar="TYPE|PATH|REC",
    type=click.Path(),
    shell_complete=completion.types_and_paths,
)
@click.argument("topics", metavar="[TOPIC]...", nargs=-1, shell_complete=completion.topics)
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
@options.distro
def command(
    wanted: str,
    topics: tuple[str, ...],
    style: str,
    package: str | None,
    include: tuple[str, ...],
    distro: str | None,
) -> int:
    """Show an interface with the messages in it and all comments.

    REC is a recording, an .mcap or .db3 file or the folder of a bag: of that, its topics with their
    types, counts and type hashes are shown, and whether the types known here are the same; or, with
    TOPIC, the definitions of their types.
    """
    from idlc.cli import output
    from idlc.diagnostics.report import Report
    from idlc.disk.scope import scope
    from idlc.disk.settings import pyproject
    from idlc.driver.show import show
    from idlc.recordings.find import is_recording

    report = Report()
    settings = pyproject.load(report)
    where = scope(settings, package, include, distro=distro)
    if is_recording(wanted) and not report.had_errors:
        from idlc.cli.show_recording import show_recording

        return show_recording(wanted, topics, style, where, report)
    if topics:
        raise click.UsageError(f"`{wanted}` is no recording, so it has no topics")
    texts = [] if report.had_errors else show(wanted, style, where, report)
    output.texts(texts, style, sys.stdout)
    output.show(report, "text", sys.stderr)
    output.notes(report, sys.stderr)
    return output.status(report)
