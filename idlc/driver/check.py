"""The pipeline of `idlc check`: everything that can be said about files and their packages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import msgspec

from idlc.disk import inputs
from idlc.disk.facts import facts
from idlc.disk.find import find
from idlc.disk.library import Library
from idlc.driver.stages import Compiler, stage
from idlc.text.diagnostics import Diagnostic, Report

if TYPE_CHECKING:
    from idlc.checks.select import Selection
    from idlc.model.link import Model
    from idlc.text.source import Source


class CheckOptions(msgspec.Struct, frozen=True):
    """What `idlc check` was asked to do."""

    paths: tuple[str, ...]
    package: str | None = None
    include: tuple[str, ...] = ()
    selection: Selection | None = None
    fix: bool = False


class Checked(msgspec.Struct, frozen=True):
    """The files that were looked at, and how many edits were made."""

    files: tuple[str, ...]
    fixed: int = 0


def check(options: CheckOptions, report: Report) -> Checked:
    """Report what is wrong with the files that paths mean, and with their packages.

    With `fix`, what can be mended without harm is mended, and the rest reported.
    """
    fixed = 0
    if options.fix:
        from idlc.disk.rewrite import mend

        found = list(_once(options, report)[1])
        if not report.had_errors:
            fixed = mend((edit for one in found for edit in one.edits), report)
    files, found = _once(options, report)
    report.extend(found)
    return Checked(files, fixed)


def _once(options: CheckOptions, report: Report) -> tuple[tuple[str, ...], list[Diagnostic]]:
    files = find(options.paths, report)
    packages = inputs.packages(files, options.package, report)
    own = {given.package: given.folders for given in packages}
    everything = Report()
    library = Library(options.include, everything, own=own)
    texts: list[Source] = []
    for given, model in Compiler(library).all(packages, everything):
        mine = model.only(given.names)
        texts += [one.source for one in mine.own if one.source]
        _advise(given, mine, library, everything)
    return tuple(file.shown for file in files), _wanted(everything, texts, options.selection)


def _advise(given: inputs.Inputs, model: Model, library: Library, report: Report) -> None:
    """Report what only `check` looks at: style, portability and the package around."""
    from idlc.checks.lint import lint
    from idlc.checks.package import check_package

    with stage("lint", given.package):
        lint(model, report)
    surroundings = facts(given, library.packages)
    if surroundings is not None:
        with stage("check package", given.package):
            check_package(surroundings, model, report)


def _wanted(
    report: Report, sources: Sequence[Source], selection: Selection | None
) -> list[Diagnostic]:
    from idlc.checks.ignores import switched_off, without_ignored
    from idlc.checks.select import Selection

    chosen = selection or Selection()
    wanted = [one for one in report if chosen.wants(one)]
    return [
        one
        for one in without_ignored(wanted, sources)
        if chosen.wants(one) and not switched_off(one, chosen)
    ]
