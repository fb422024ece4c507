"""The body of `idlc check`, free of click."""

from __future__ import annotations

import sys

import msgspec

from idlc.checks import settings as check_settings
from idlc.cli import output, reports
from idlc.diagnostics.report import Report
from idlc.disk.scope import scope
from idlc.disk.settings import pyproject
from idlc.driver.check import Checked, CheckOptions, check


class Wishes(msgspec.Struct, frozen=True):
    """What was typed besides paths; `select` and `ignore` are lists of rules with commas."""

    select: str | None = None
    ignore: str | None = None
    fix: bool = False
    strict: bool = False
    package: str | None = None
    include: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    style: str = "text"
    statistics: bool = False
    prefix: str | None = None
    distro: str | None = None


def check_paths(paths: tuple[str, ...], wishes: Wishes | None = None) -> int:
    """Check what paths mean, or pyproject.toml, or the working folder; return the exit status."""
    wishes = wishes or Wishes()
    report = Report()
    settings = pyproject.load(report)
    configured = check_settings.selection(settings, report)
    chosen = configured.with_lists(wishes.select, wishes.ignore)
    checked = Checked(())
    if wishes.prefix is not None:
        from idlc.driver.prefix import check_prefix

        checked = check_prefix(wishes.prefix, report)
    elif not report.had_errors:
        wanted = CheckOptions(
            paths=paths or settings.paths or (".",),
            scope=scope(settings, wishes.package, wishes.include, wishes.exclude, wishes.distro),
            selection=chosen,
            fix=wishes.fix,
        )
        checked = check(wanted, report)
    numbers, strict = wishes.statistics, wishes.strict
    reports.write(report, wishes.style, checked, sys.stdout, numbers=numbers, strict=strict)
    return output.status(report) or int(wishes.strict and bool(len(report)))
