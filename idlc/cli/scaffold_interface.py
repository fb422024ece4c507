"""`idlc scaffold interface`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import options
from idlc.cli.scaffold import common, finish

EPILOG = options.example(
    "idlc scaffold interface msg RobotCommand \\",
    "    'string command_type' 'float32 linear_velocity_x  # [m/s]'",
    "idlc scaffold interface srv AddTwoInts 'int64 a' 'int64 b' --- 'int64 sum'",
    title="Example, within a package",
)


@click.command("interface", epilog=EPILOG, context_settings={"ignore_unknown_options": True})
@click.argument("kind", type=click.Choice(["msg", "srv", "action"]))
@click.argument("name", metavar="NAME")
@click.argument("fields", metavar="FIELD...", nargs=-1, type=click.UNPROCESSED)
@common
def command(
    kind: str,
    name: str,
    fields: tuple[str, ...],
    include: tuple[str, ...],
    **arguments: Any,
) -> int:
    """Create an interface in the package that contains the working folder.

    FIELD is a line of the file, such as 'float32 speed 0.5  # [m/s]', a constant or a comment.
    `---` separates the sections of services and actions.
    """
    from idlc.diagnostics.report import Report
    from idlc.model.ir import KINDS
    from idlc.project.root import Root
    from idlc.scaffold import interface
    from idlc.scaffold.changes import Settings

    report = Report()
    try:
        interface.check_interface_name(name)
        interface.interface_text(kind, fields)
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    settings = Settings(Root.here(), include=include, **arguments)
    checked_kind = KINDS[KINDS.index(kind)]
    result = interface.interface(checked_kind, name, fields, settings, report)
    return finish(result, report)
