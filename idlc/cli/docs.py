"""`idlc docs`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from idlc.cli import options

if TYPE_CHECKING:
    from idlc.diagnostics.report import Report
    from idlc.project.settings import Scope


@click.command("docs", epilog=options.example(*options.DEMO, "idlc docs demo -o site"))
@click.argument("paths", metavar="[PATH|PACKAGE|TYPE]...", nargs=-1, type=click.Path())
@click.option("-o", "--out", metavar="DIR", required=True, type=click.Path(), help="Output folder.")
@options.scoped(options.package, options.include, options.exclude, options.distro)
def command(paths: tuple[str, ...], out: str, scope: Scope, report: Report) -> str:
    """Generate a static HTML site that describes interfaces and links their types.

    The site also shows units, constants and type hashes, and has a search. It needs no server and
    loads nothing from other hosts. PACKAGE and TYPE are names, as in
    `idlc gen`.
    """
    from idlc.diagnostics.terminal import counted
    from idlc.tasks.docs.pages import docs

    pages = docs(paths or scope.paths or (".",), out, scope, report)
    return f"{counted(pages, 'page')} written; open {out}/index.html\n" if pages else ""
