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
    help="Copy one into your folder of templates, to change it there. May be repeated.",
)
@writing
def command(copies: tuple[str, ...], **arguments: Any) -> int:
    """List the templates of nodes and packages, or copy some to change them.

    Your folder is that of --templates, or of `templates` in [tool.idlc]; otherwise copies go to
    templates/. A template there is used instead of the one of the same name.
    """
    from idlc.diagnostics.report import Report
    from idlc.diagnostics.text import did_you_mean
    from idlc.project.root import Root
    from idlc.scaffold import changes
    from idlc.scaffold.changes import Settings
    from idlc.scaffold.templates import names

    for name in copies:
        if name not in names():
            hint = did_you_mean(name, names()) or "`idlc scaffold templates` lists them"
            raise click.UsageError(f"there is no template {name!r}; {hint}")
    if copies:
        report = Report()
        result = changes.copied(copies, Settings(Root.here(), **arguments), report)
        return finish(result, report)
    sys.stdout.writelines(f"{name}\n" for name in names())
    return 0
