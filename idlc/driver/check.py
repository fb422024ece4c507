"""The pipeline of `idlc check`: every problem of files and of their packages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import msgspec

from idlc.checks.select import Selection
from idlc.diagnostics.report import Diagnostic, Report
from idlc.disk import inputs
from idlc.disk.find import KINDS, look, nothing_in
from idlc.disk.library import Library
from idlc.disk.package_facts import facts
from idlc.disk.read import absolute
from idlc.disk.scope import Scope
from idlc.driver.stages import Compiler, library_for, stage

if TYPE_CHECKING:
    from idlc.diagnostics.source import Source
    from idlc.model.link import Model


class CheckOptions(msgspec.Struct, frozen=True):
    """What `idlc check` was asked to do."""

    paths: tuple[str, ...]
    scope: Scope = Scope()
    selection: Selection = Selection()
    fix: bool = False


class Checked(msgspec.Struct, frozen=True):
    """The files and packages that were looked at, and how many edits were made.

    `distros` are the distributions that they were checked for, if those are several.
    """

    files: tuple[str, ...]
    packages: int = 0
    fixed: int = 0
    distros: tuple[str, ...] = ()


def check(options: CheckOptions, report: Report) -> Checked:
    """Report what is wrong with the files that paths mean, and with their packages.

    With `fix`, what can be fixed without harm is fixed, and the rest reported.
    """
    if not all(path.endswith(tuple(KINDS)) for path in options.paths):
        from idlc.recordings.find import divided

        recordings, others = divided(options.paths)
        if recordings:
            return _with_recordings(recordings, others, options, report)
    fixed = 0
    if options.fix:
        from idlc.disk.output.rewrite import edit

        found = _once(options, report)[1]
        if not report.had_errors:
            fixed = edit((one for problem in found for one in problem.edits), report, _tidied)
    checked, found = _once(options, report)
    report.extend(found)
    return msgspec.structs.replace(checked, fixed=fixed)


def _with_recordings(
    recordings: Sequence[str], others: Sequence[str], options: CheckOptions, report: Report
) -> Checked:
    """Report what is wrong with recordings, and with other paths if there are any."""
    from idlc.driver.recorded_models import check_recordings

    found = Report()
    check_recordings(recordings, options.scope, found)
    report.extend(one for one in found if options.selection.wants(one))
    report.notes += found.notes
    checked = Checked(())
    if others:
        checked = check(msgspec.structs.replace(options, paths=tuple(others)), report)
    return msgspec.structs.replace(checked, files=(*recordings, *checked.files))


def _tidied(name: str, old: str, new: str) -> str:
    """Return an edited file as `idlc fmt` has it, if it was so before."""
    from idlc.diagnostics.source import Source
    from idlc.model.ir import KINDS
    from idlc.syntax.format import format_file
    from idlc.syntax.parse import parse

    is_interface = name.rpartition(".")[2] in KINDS
    if not is_interface or format_file(parse(Source(name, old))) != old:
        return new
    return format_file(parse(Source(name, new)))


def _once(options: CheckOptions, report: Report) -> tuple[Checked, list[Diagnostic]]:
    scope = options.scope
    there = look(options.paths, report, scope.exclude)
    packages = inputs.packages(there.files, scope, report, there.packages)
    for path in there.empty:
        if not any(one.home.is_relative_to(absolute(path)) for one in packages):
            report.add(nothing_in(path, scope.exclude, also="package.xml and no "))
    found: dict[str, Report] = {}
    texts: dict[str, Source] = {}
    for distro in scope.distros or (scope.distro,):
        found[distro.name] = Report()
        narrowed = msgspec.structs.replace(scope, distros=(distro,))
        alone = msgspec.structs.replace(options, scope=narrowed)
        texts |= _compiled(packages, alone, found[distro.name])
    files = tuple(file.shown for file in there.files)
    sources = list(texts.values())
    if len(found) == 1:
        (everything,) = found.values()
        return Checked(files, len(packages)), _wanted(everything, sources, options.selection)
    from idlc.diagnostics.merge import merged, without_overruled

    wanted = _wanted(merged(found), sources, options.selection)
    checked = Checked(files, len(packages), distros=tuple(found))
    return checked, list(without_overruled(wanted))


def _compiled(
    packages: Sequence[inputs.Inputs], options: CheckOptions, report: Report
) -> dict[str, Source]:
    """Report what is wrong for one distribution; return the texts by path."""
    library = library_for(packages, options.scope, report)
    texts: dict[str, Source] = {}
    for given, model in Compiler(library).all(packages, report):
        mine = model.only(given.names)
        texts |= {one.source.path: one.source for one in mine.own if one.source}
        _advise(given, mine, library, options, report)
    return texts


def _advise(
    given: inputs.Inputs, model: Model, library: Library, options: CheckOptions, report: Report
) -> None:
    """Report what only `check` looks at: style, portability and the package around."""
    from idlc.checks.registry import advise, check_package

    with stage("advise", given.package):
        advise(model, report, options.selection)
    surroundings = facts(given, library.packages, options.scope.exclude)
    if surroundings is not None:
        with stage("check package", given.package):
            check_package(surroundings, model, report, options.selection)


def _wanted(report: Report, sources: Sequence[Source], selection: Selection) -> list[Diagnostic]:
    from idlc.checks.ignores import switched_off, without_ignored

    wanted = [one for one in report if selection.wants(one)]
    return [
        one
        for one in without_ignored(wanted, sources)
        if selection.wants(one) and not switched_off(one, selection)
    ]
