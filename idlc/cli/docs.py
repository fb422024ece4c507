"""`idlc docs`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import options


@click.command("docs", epilog=options.example(*options.DEMO, "idlc docs demo -o site"))
@click.argument("paths", metavar="[PATH|PACKAGE|TYPE]...", nargs=-1, type=click.Path())
@click.option("-o", "--out", metavar="DIR", required=True, type=click.Path(), help="Output folder.")
@options.scoped(options.package, options.include, options.exclude, options.distro)
def command(**arguments: Any) -> str:
    """Generate a static HTML site that describes interfaces and links their types.

    The site also shows units, constants and type hashes, and has a search. It needs no server and
    loads nothing from other hosts. PACKAGE and TYPE are names, as in
    `idlc gen`.
    """
    from idlc.cli.run.look import write_docs

    return write_docs(**arguments)
