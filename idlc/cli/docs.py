"""`idlc docs`."""

from __future__ import annotations

import sys

import click

from idlc.cli import options

EPILOG = """\
Example:

\b
  mkdir -p demo/msg
  echo 'float64 speed 0.5  # [m/s]' > demo/msg/Drive.msg
  idlc docs demo -o site
"""


@click.command("docs", epilog=EPILOG)
@click.argument("paths", metavar="[PATH|PACKAGE|TYPE]...", nargs=-1, type=click.Path())
@click.option("-o", "--out", metavar="DIR", required=True, type=click.Path(), help="The site.")
@options.package
@options.include
@options.exclude
@options.distro
def command(
    paths: tuple[str, ...],
    out: str,
    package: str | None,
    include: tuple[str, ...],
    exclude: tuple[str, ...],
    distro: str | None,
) -> int:
    """Write a static HTML site about interfaces: links, units, constants, hashes, a search.

    It needs no server and loads nothing from elsewhere. PACKAGE and TYPE are names, as for `gen`.
    """
    from idlc.cli import output
    from idlc.diagnostics.report import Report
    from idlc.diagnostics.terminal import counted
    from idlc.documents.docs import docs
    from idlc.project.root import Root
    from idlc.project.settings import load_settings, scope

    report = Report()
    settings = load_settings(Root.here(), report)
    pages = 0
    if not report.had_errors:
        paths = paths or settings.paths or (".",)
        pages = docs(paths, out, scope(settings, package, include, exclude, distro), report)
    output.show(report, "text", sys.stderr)
    output.notes(report, sys.stderr)
    if pages:
        sys.stdout.write(f"{counted(pages, 'page')} in {out}, begin with {out}/index.html\n")
    return output.status(report)
