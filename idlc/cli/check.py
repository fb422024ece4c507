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
@click.option("--select", metavar="RULE,...", help="Only these: categories, codes or `all`.")
@click.option("--ignore", metavar="RULE,...", help="Not these.")
@click.option("--fix", is_flag=True, help="Mend what can be mended without harm.")
@click.option("--strict", is_flag=True, help="Fail on warnings as well.")
@options.package
@options.include
@options.report_style
def command(
    paths: tuple[str, ...],
    select: str | None,
    ignore: str | None,
    fix: bool,
    strict: bool,
    package: str | None,
    include: tuple[str, ...],
    style: str,
) -> int:
    """Report every problem of interface files and of the packages around them.

    PATH is a folder of packages, a package folder, a folder of interface files, or a .msg, .srv
    or .action file; without it, `paths` in pyproject.toml, or the working folder.

    Categories of rules are correctness, portability, style and package; `idlc explain` knows each.
    """
    from idlc.cli import reports, terminal
    from idlc.disk import config, tables
    from idlc.driver.check import Checked, CheckOptions, check
    from idlc.text.diagnostics import Report

    report = Report()
    settings = config.load(report)
    chosen = options.selection(tables.selection(settings, report), select, ignore)
    checked = Checked(())
    if not report.had_errors:
        wanted = CheckOptions(
            paths=paths or settings.paths or (".",),
            package=package or settings.package,
            include=(*include, *settings.include),
            selection=chosen,
            fix=fix,
        )
        checked = check(wanted, report)
    reports.write(report, style, checked.files, checked.fixed, sys.stdout)
    return terminal.status(report) or int(strict and bool(len(report)))
