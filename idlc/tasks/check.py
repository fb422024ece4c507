"""The pipeline of `idlc check`: every problem of files and of their packages."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import msgspec

from idlc.check import builds, cmake_lists, outputs
from idlc.check.registry import advise, check_package
from idlc.check.select import RuleSelection, switched_off, without_ignored
from idlc.compiler.compiler import Compiler, library_for, stage
from idlc.compiler.verdicts import IncrementalFindings
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report, first_few, merge, without_overruled
from idlc.diagnostics.source import Source
from idlc.language.parse import parse
from idlc.model import link
from idlc.model.link import Model
from idlc.packaging.dependencies import Neighbours
from idlc.packaging.facts import Facts, facts
from idlc.packaging.files import PACKAGE_FILES, SETUP_PY
from idlc.project import inputs
from idlc.project.files import is_folder
from idlc.project.find import KINDS, RULES, list_files, no_interfaces, unread_idl
from idlc.project.lock import Lock
from idlc.project.root import MANIFEST, Root
from idlc.project.settings import Scope
from idlc.project.words import split_recordings

#: Problems with files and packages that are left out; the others can be fixed.
_DUPLICATES = frozenset({codes.DUPLICATE_INTERFACE.id, codes.DUPLICATE_PACKAGE.id})
#: Rounds of fixes: one may depend on another, or edit the same range.
_ROUNDS = 5


class CheckOptions(msgspec.Struct, frozen=True):
    """The options of `idlc check`."""

    paths: tuple[str, ...]
    scope: Scope
    selection: RuleSelection = RuleSelection()
    fix: bool = False
    diff: bool = False


class CheckResult(msgspec.Struct, frozen=True):
    """The checked files and packages, and the number of edits that were made.

    `distros` are the distributions that they were checked for, if there are several. `notes` name
    what was not compared. `texts` are the texts of edited files before and after, by name.
    """

    files: tuple[str, ...]
    packages: int = 0
    fixed: int = 0
    distros: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    texts: Mapping[str, tuple[str, str]] = {}


def check(options: CheckOptions, report: Report) -> CheckResult:
    """Report the problems of the files in paths, and of their packages.

    With `fix`, problems with a safe edit are fixed, and the others reported. With `diff`, the
    edits are made in memory only.
    """
    if not all(path.endswith(tuple(KINDS)) for path in options.paths):
        recordings, others = split_recordings(options.paths, options.scope.root)
        if recordings:
            return _with_recordings(recordings, others, options, report)
    return _check_files(options, report)


def _check_files(options: CheckOptions, report: Report) -> CheckResult:
    fixed = 0
    texts: dict[str, tuple[str, str]] = {}
    scope, selection = options.scope, options.selection
    paths = _with_packages(options.paths, scope.root)
    for rounds_left in reversed(range(_ROUNDS + 1)):
        looked = Report()
        listing = list_files(paths, scope.root, looked, scope.exclude)
        packages = inputs.packages(listing.files, scope, looked, listing.packages)
        looked.extend(_without_packages(listing.empty, packages, scope))
        checking = checkers(packages, scope)
        problems, models = check_all(checking, packages, selection)
        edits = [change for problem in problems for change in problem.edits]
        if not ((options.fix or options.diff) and edits and rounds_left):
            break
        if report.had_errors or any(each.code not in _DUPLICATES for each in looked.errors):
            looked.notes.append("idlc fixed nothing, because it could not read all files")
            break
        from idlc.project.write import edited, rewrite

        root, before = scope.root, fixed
        for name, old, new, number in edited(edits, keep_layout):
            if options.diff or rewrite(Path(root.path(name)), name, old, new, report):
                texts[name] = (texts.get(name, (old,))[0], new)
                fixed += number
        if fixed == before:
            break
        if options.diff:
            unsaved = {root.absolute(name): new.encode() for name, (_, new) in texts.items()}
            scope = msgspec.structs.replace(scope, root=Root(root.base, unsaved))
    files = tuple(file.shown for file in listing.files)
    distros = tuple(models) if len(models) > 1 else ()
    report.extend((*looked, *problems))
    report.notes += looked.notes
    first = next(iter(checking.values()))
    looked_at = filter(None, map(first.package_facts, packages))
    notes = (*_unjudged(looked_at), *filter(None, (_unread(each, scope) for each in packages)))
    return CheckResult(files, len(packages), fixed, distros, notes, texts)


def _unjudged(packages: Iterable[Facts]) -> Iterator[str]:
    """Yield what `check` cannot judge in the builds of packages."""
    for package in packages:
        yield from filter(None, (cmake_lists.unknown(package), builds.unjudged(package)))


def _unread(package: inputs.Inputs, scope: Scope) -> str:
    """Return a note on the .idl files of a package of which all files are checked."""
    is_whole = not package.files or package.is_whole(scope.root)
    names = unread_idl(package.folders, scope.exclude) if is_whole else []
    files = first_few((f"`{name}`" for name in names), 3)
    return f"`{package.package}`: idlc does not check .idl files, such as {files}" if names else ""


def _without_packages(
    paths: Iterable[str], packages: Collection[inputs.Inputs], scope: Scope
) -> Iterator[Diagnostic]:
    """Yield a problem for each path without interfaces in which there is no package either."""
    for path in paths:
        folder = scope.root.absolute(path)
        if not any(package.home.is_relative_to(folder) for package in packages):
            yield no_interfaces(path, scope.root, scope.exclude, also="package.xml and no ")


def _with_packages(paths: Sequence[str], root: Root) -> tuple[str, ...]:
    """Return paths with the package in place of each file that describes it, none elsewhere."""
    described = []
    for path in paths:
        folder, name = os.path.split(path)
        # hooks name such files if they change
        if name not in PACKAGE_FILES or not root.is_file(path):
            described.append(path)
        elif root.is_file(f"{folder or '.'}/{MANIFEST}"):
            described.append(folder or ".")
    return tuple(dict.fromkeys(described))


def _with_recordings(
    recordings: Sequence[str], others: Sequence[str], options: CheckOptions, report: Report
) -> CheckResult:
    """Report the problems of recordings, and of other paths if there are any."""
    from idlc.tasks.check_recordings import check_recordings

    problems = Report()
    check_recordings(recordings, options.scope, problems)
    report.extend(problem for problem in problems if options.selection.wants(problem))
    checked = CheckResult(())
    if others:
        checked = check(msgspec.structs.replace(options, paths=tuple(others)), report)
    files, notes = (*recordings, *checked.files), (*problems.notes, *checked.notes)
    return msgspec.structs.replace(checked, files=files, notes=notes)


def keep_layout(name: str, old: str, new: str) -> str:
    """Return an edited file in its old layout: `idlc fmt`'s, or that of formatters of Python."""
    if name.endswith(SETUP_PY):
        from idlc.packaging.setup_edits import arrange

        return arrange(old, new)
    from idlc.language.format import format_file

    is_interface = name.endswith(tuple(KINDS))
    if not is_interface or format_file(parse(Source(name, old))) != old:
        return new
    return format_file(parse(Source(name, new)))


def checkers(
    packages: Sequence[inputs.Inputs], scope: Scope, *, again: bool = False
) -> dict[str, Checker]:
    """Return the checker of packages for each distribution; `again`: they check repeatedly."""
    distros = scope.distros or (scope.distro,)
    scopes = [msgspec.structs.replace(scope, distros=(distro,)) for distro in distros]
    return {each.distro.name: Checker(packages, each, again=again) for each in scopes}


class Checker:
    """Checks packages for one distribution, repeatedly as some of their texts change.

    Everything else on disk is assumed unchanged since it was first read.
    """

    def __init__(
        self, packages: Sequence[inputs.Inputs], scope: Scope, *, again: bool = False
    ) -> None:
        self._scope = scope
        self.library = library_for(packages, scope, Report())
        folders = {package.package: package.folders for package in packages}
        self._neighbours = Neighbours(folders, scope.root)
        self._lowered: link.Memory = {}
        # dependencies between interfaces are only worth remembering for a next run
        self._checked = IncrementalFindings() if again else None
        self._advised = IncrementalFindings() if again else None
        self._facts: dict[str, Facts | None] = {}
        self._records: dict[str, dict[Path, Lock]] = {}

    def check(self, packages: Sequence[inputs.Inputs], report: Report) -> list[Model]:
        """Report problems, selected or not; return packages' models, limited to checked files."""
        self.library.report_to(report)
        models = []
        compiler = Compiler(self.library, self._lowered, self._checked)
        for package, model in compiler.all(packages, report):
            models.append(model.only(package.names))
            with stage("advise", package.package):
                advise(models[-1], report, self._advised)
            surroundings = self.package_facts(package)
            if surroundings is not None:
                with stage("check package", package.package):
                    check_package(surroundings, models[-1], report)
            records = self._outputs(package)
            report.extend(outputs.current_outputs(package, model, records, self._scope))
            if any(is_folder(folder / RULES) for folder in package.folders):
                from idlc.versions.coverage import rule_folders, rule_problems

                with stage("check rules", package.package):
                    folders = rule_folders(package.folders)
                    report.extend(rule_problems(folders, model, self._scope.root))
        return models

    def _outputs(self, package: inputs.Inputs) -> dict[Path, Lock]:
        if package.package not in self._records:
            self._records[package.package] = outputs.outputs(package, self._scope)
        return self._records[package.package]

    def package_facts(self, package: inputs.Inputs) -> Facts | None:
        """Return the facts about a package, with its current texts."""
        if package.package not in self._facts:
            self._facts[package.package] = facts(
                package, self.library.packages, self._neighbours, self._scope
            )
        current = self._facts[package.package]
        if current is None or not current.inputs:
            return current
        return msgspec.structs.replace(current, inputs=package.digests)


def check_all(
    checkers: Mapping[str, Checker], packages: Sequence[inputs.Inputs], selection: RuleSelection
) -> tuple[list[Diagnostic], dict[str, list[Model]]]:
    """Return the problems to show, each once, and the models for each distribution."""
    reports = {distro: Report() for distro in checkers}
    items = checkers.items()
    models = {distro: checker.check(packages, reports[distro]) for distro, checker in items}
    own = (interface for some in models.values() for model in some for interface in model.own)
    sources = {part.source.path: part.source for part in own if part.source}.values()
    together = merge(reports) if len(reports) > 1 else next(iter(reports.values()))
    selected = [problem for problem in together if selection.wants(problem)]
    problems = [
        problem
        for problem in without_ignored(selected, sources)
        if selection.wants(problem) and not switched_off(problem, selection)
    ]
    return list(without_overruled(problems)), models
