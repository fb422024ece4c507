"""The pipeline of `idlc check`: every problem of files and of their packages."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import msgspec

from idlc.check.compiler import Compiler, library_for, stage
from idlc.check.package.facts import facts
from idlc.check.select import Selection
from idlc.diagnostics.report import Diagnostic, Report
from idlc.project import inputs
from idlc.project.find import KINDS, look, nothing_in
from idlc.project.settings import Scope

if TYPE_CHECKING:
    from idlc.check.registry import Memory
    from idlc.diagnostics.source import Source
    from idlc.model import link
    from idlc.model.link import Model
    from idlc.project.package_xml import Facts

#: How often fixes are made: one may be what another needs, or edit the place of another.
_ROUNDS = 5


class CheckOptions(msgspec.Struct, frozen=True):
    """What `idlc check` was asked to do."""

    paths: tuple[str, ...]
    scope: Scope
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

        recordings, others = divided(options.paths, options.scope.root)
        if recordings:
            return _with_recordings(recordings, others, options, report)
    fixed = 0
    for rounds_left in reversed(range(_ROUNDS + 1)):
        looked = Report()
        checked, found = _once(options, looked)
        edits = [one for problem in found for one in problem.edits]
        if not (options.fix and edits and rounds_left) or looked.had_errors or report.had_errors:
            break
        from idlc.project.atomic import edit

        done = edit(edits, options.scope.root, report, tidied)
        fixed += done
        if not done:
            break
    report.extend((*looked, *found))
    report.notes += looked.notes
    return msgspec.structs.replace(checked, fixed=fixed)


def _with_recordings(
    recordings: Sequence[str], others: Sequence[str], options: CheckOptions, report: Report
) -> Checked:
    """Report what is wrong with recordings, and with other paths if there are any."""
    from idlc.recordings.packages import check_recordings

    found = Report()
    check_recordings(recordings, options.scope, found)
    report.extend(one for one in found if options.selection.wants(one))
    report.notes += found.notes
    checked = Checked(())
    if others:
        checked = check(msgspec.structs.replace(options, paths=tuple(others)), report)
    return msgspec.structs.replace(checked, files=(*recordings, *checked.files))


def tidied(name: str, old: str, new: str) -> str:
    """Return an edited file laid out as it was: by `idlc fmt`, or a setup.py without long lines."""
    if name.endswith("setup.py"):
        from idlc.check.package.setup_edits import wrapped

        return wrapped(old, new)
    from idlc.diagnostics.source import Source
    from idlc.language.format import format_file
    from idlc.language.parse import parse

    is_interface = name.endswith(tuple(KINDS))
    if not is_interface or format_file(parse(Source(name, old))) != old:
        return new
    return format_file(parse(Source(name, new)))


def _once(options: CheckOptions, report: Report) -> tuple[Checked, list[Diagnostic]]:
    scope = options.scope
    root = scope.root
    there = look(options.paths, root, report, scope.exclude)
    packages = inputs.packages(there.files, scope, report, there.packages)
    for path in there.empty:
        if not any(one.home.is_relative_to(root.absolute(path)) for one in packages):
            report.add(nothing_in(path, root, scope.exclude, also="package.xml and no "))
    found: dict[str, Report] = {}
    models: list[Model] = []
    for distro, checker in checkers(packages, scope).items():
        found[distro] = Report()
        models += checker.check(packages, options.selection, found[distro])
    files = tuple(file.shown for file in there.files)
    distros = tuple(found) if len(found) > 1 else ()
    checked = Checked(files, len(packages), distros=distros)
    return checked, judged(found, models, options.selection)


def checkers(
    packages: Sequence[inputs.Inputs], scope: Scope, *, again: bool = False
) -> dict[str, Checker]:
    """Return what checks packages, for each distribution by its name; `again`: more than once."""
    distros = scope.distros or (scope.distro,)
    return {
        one.name: Checker(packages, msgspec.structs.replace(scope, distros=(one,)), again=again)
        for one in distros
    }


def _memory() -> Memory:
    from idlc.check.registry import Memory

    return Memory()


class Checker:
    """Checks packages for one distribution, also again after some of their texts changed.

    Everything else on disk is as it was when it was first looked at.
    """

    def __init__(
        self, packages: Sequence[inputs.Inputs], scope: Scope, *, again: bool = False
    ) -> None:
        self._scope = scope
        self.library = library_for(packages, scope, Report())
        self._lowered: link.Memory = {}
        # what each interface depends on is only worth remembering if there is a next time
        self._checked = _memory() if again else None
        self._advised = _memory() if again else None
        self._facts: dict[str, Facts | None] = {}

    def check(
        self, packages: Sequence[inputs.Inputs], selection: Selection, report: Report
    ) -> list[Model]:
        """Report what is wrong; return the model of each package, with only the given files."""
        self.library.report_to(report)
        models = []
        compiler = Compiler(self.library, self._lowered, self._checked)
        for given, model in compiler.all(packages, report):
            models.append(model.only(given.names))
            self._advise(given, models[-1], selection, report)
        return models

    def _advise(
        self, given: inputs.Inputs, model: Model, selection: Selection, report: Report
    ) -> None:
        """Report what only `check` looks at: style, portability and the package around."""
        from idlc.check.registry import advise, check_package

        with stage("advise", given.package):
            advise(model, report, selection, self._advised)
        surroundings = self.around(given)
        if surroundings is not None:
            with stage("check package", given.package):
                check_package(surroundings, model, report, selection)

    def around(self, given: inputs.Inputs) -> Facts | None:
        """Return what surrounds a package, with the texts that it has now."""
        if given.package not in self._facts:
            found = facts(given, self.library.packages, self._scope)
            self._facts[given.package] = found
        known = self._facts[given.package]
        if known is None or not known.inputs:
            return known
        return msgspec.structs.replace(known, inputs=given.digests)


def judged(
    found: Mapping[str, Report], models: Iterable[Model], selection: Selection
) -> list[Diagnostic]:
    """Return the problems to be shown of those that were found for distributions, each once."""
    texts = {one.source.path: one.source for model in models for one in model.own if one.source}
    sources = list(texts.values())
    if len(found) == 1:
        (everything,) = found.values()
        return _wanted(everything, sources, selection)
    from idlc.diagnostics.report import merged, without_overruled

    return list(without_overruled(_wanted(merged(found), sources, selection)))


def _wanted(report: Report, sources: Sequence[Source], selection: Selection) -> list[Diagnostic]:
    from idlc.check.select import switched_off, without_ignored

    wanted = [one for one in report if selection.wants(one)]
    return [
        one
        for one in without_ignored(wanted, sources)
        if selection.wants(one) and not switched_off(one, selection)
    ]
