"""`idlc scaffold templates`."""

from __future__ import annotations

import sys
from typing import Any

import click

from idlc.cli import completion, options
from idlc.cli.scaffold import finish, writing


@click.command(
    "templates",
    epilog=options.example(
        "idlc scaffold templates", "idlc scaffold templates --copy node/publisher.py.jinja"
    ),
)
@click.option(
    "--copy",
    "copies",
    metavar="NAME",
    multiple=True,
    shell_complete=completion.templates,
    help="Copy this template into your folder of templates. May be repeated.",
)
@writing
def command(copies: tuple[str, ...], **arguments: Any) -> int:
    """List the templates for nodes and packages, or copy templates so that you can change them.

    --copy writes to the folder that you pass with --templates. Without --templates, it writes to
    the folder in the setting `templates` of [tool.idlc]. If neither exists, it writes to the folder
    templates/. A template in your folder replaces idlc's template of the same name.
    """
    from idlc.diagnostics.report import Report
    from idlc.project.root import Root
    from idlc.scaffold import changes
    from idlc.scaffold.changes import Settings
    from idlc.scaffold.templates import names, suggestion

    for name in copies:
        if name not in names():
            hint = suggestion(name) or "`idlc scaffold templates` lists them"
            raise click.UsageError(f"no such template: {name!r}; {hint}")
    if copies:
        report = Report()
        result = changes.copied(copies, Settings(Root.here(), **arguments), report)
        return finish(result, report)
    sys.stdout.writelines(f"{name}\n" for name in names())
    return 0
