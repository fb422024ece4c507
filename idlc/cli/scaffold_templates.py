"""`idlc scaffold templates`."""

from __future__ import annotations

import sys
from typing import Any

import click

from idlc.cli import completion
from idlc.cli.scaffold import finish, writing

EPILOG = """\
Example:

\b
  idlc scaffold templates --list
  idlc scaffold templates --copy node/publisher.py.jinja
"""


@click.command("templates", epilog=EPILOG)
@click.option("--list", "listing", is_flag=True, help="List the templates; this is the default.")
@click.option(
    "--copy",
    "copies",
    metavar="NAME",
    multiple=True,
    shell_complete=completion.templates,
    help="Copy one into your folder of templates, to change it there. May be repeated.",
)
@writing
def command(copies: tuple[str, ...], listing: bool, **arguments: Any) -> int:
    """List the templates of nodes, their tests and packages, or copy some to change them.

    Your folder is that of --templates, or of `templates` in [tool.idlc]; otherwise copies go to
    templates/. A template there is used instead of the one of the same name.
    """
    from idlc.cli import output
    from idlc.diagnostics.report import Report
    from idlc.project.root import Root
    from idlc.scaffold import changes
    from idlc.scaffold.changes import Settings
    from idlc.scaffold.templates import names, suggestion

    if listing and copies:
        raise click.UsageError("--list and --copy do not go together")
    for name in copies:
        if name not in names():
            hint = suggestion(name) or "`idlc scaffold templates` lists them"
            raise click.UsageError(f"there is no template {name!r}; {hint}")
    report = Report()
    settings = Settings(Root.here(), **arguments)
    if copies:
        return finish(changes.copied(copies, settings, report), report)
    listed = changes.listed(settings, report)
    output.show(report, "text", sys.stderr)
    width = max(len(template.name) for template in listed)
    for template in listed:
        replaced = f"  replaced by {template.replaced_by}" if template.replaced_by else ""
        sys.stdout.write(f"{template.name:{width}}{replaced}".rstrip() + "\n")
    return output.status(report)
