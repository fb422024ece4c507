"""`idlc check`."""

from __future__ import annotations

import sys

import click

from idlc.cli import options

EPILOG = """\
Example:

\b
  mkdir -p demo/msg
  echo 'float64 speed 0.5  # [m/s]' > demo/msg/Drive.msg
  idlc check demo
"""


@click.command("check", epilog=EPILOG)
@click.argument("paths", metavar="[PATH]...", nargs=-1, type=click.Path())
@options.package
@options.include
@options.style
def command(
    paths: tuple[str, ...], package: str | None, include: tuple[str, ...], style: str
) -> int:
    """Report every problem of interface files.

    PATH is a folder of packages, a package folder, a folder of interface files, or a .msg, .srv
    or .action file; without it, `paths` in pyproject.toml, or the working folder.
    """
    from idlc.cli import terminal
    from idlc.disk import config
    from idlc.driver.query import check
    from idlc.text.diagnostics import Report
    from idlc.text.present import counted, summary

    report = Report()
    settings = config.load(report)
    files = 0
    if not report.had_errors:
        paths = paths or settings.paths or (".",)
        files = check(paths, package or settings.package, (*include, *settings.include), report)
    terminal.show(report, style, sys.stdout)
    if style == "json":
        terminal.fact(sys.stdout, "summary", **terminal.counts(report), files=files)
    elif len(report):
        sys.stdout.write(f"{summary(report)}\n")
    else:
        sys.stdout.write(f"no problems in {counted(files, 'file')}\n")
    return terminal.status(report)
