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
@click.argument("paths", metavar="[PATH]...", nargs=-1, type=click.Path())
@click.option("-o", "--out", metavar="DIR", required=True, type=click.Path(), help="The site.")
@options.package
@options.include
@options.exclude
def command(
    paths: tuple[str, ...],
    out: str,
    package: str | None,
    include: tuple[str, ...],
    exclude: tuple[str, ...],
) -> int:
    """Write a static HTML site about interfaces: links, units, constants, hashes, a search.

    It needs no server and loads nothing from elsewhere.
    """
    from idlc.cli import terminal
    from idlc.disk import config
    from idlc.disk.scope import scope
    from idlc.driver.docs import docs
    from idlc.text.diagnostics import Report
    from idlc.text.present import counted

    report = Report()
    settings = config.load(report)
    pages = 0
    if not report.had_errors:
        paths = paths or settings.paths or (".",)
        pages = docs(paths, out, scope(settings, package, include, exclude), report)
    terminal.show(report, "text", sys.stderr)
    terminal.notes(report, sys.stderr)
    if pages:
        sys.stdout.write(f"{counted(pages, 'page')} in {out}, begin with {out}/index.html\n")
    return terminal.status(report)
