"""The pipeline of `idlc breaking --against REC`: changes since a recording was made."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Sequence
from typing import NamedTuple

from idlc.api.sources import read_source
from idlc.compiler.compiler import stage
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, first_few
from idlc.model import ir
from idlc.model.link import Model
from idlc.project import inputs
from idlc.project.find import find
from idlc.recordings.definitions import RecordedDefinition
from idlc.recordings.find import split_recordings
from idlc.recordings.types import NAMED, LocalTypes, recorded_types, topics_of, versions
from idlc.tasks.breaking.files import BreakingOptions, error_free_models, judge
from idlc.versions.changes import Change
from idlc.versions.packages import Comparison, compare


class RecordedVerdict(NamedTuple):
    """The result: the number of changes by broken level, and of compared items by kind.

    `others` counts changes without effect on readers if no level was selected, `hidden` changes
    that break only other levels than the selected ones.
    """

    levels: dict[str, int]
    allowed: int
    others: int
    seen: dict[str, int]
    hidden: int


def compare_with_recordings(
    options: BreakingOptions, recordings: Sequence[str], report: Report
) -> RecordedVerdict | None:
    """Report changes since recordings were made; `None` if something could not be read.

    The interfaces of PATHs are compared, or without PATHs the ones of this machine. Without levels,
    only changes that affect readers are reported.
    """
    root, local = options.scope.root, LocalTypes(options.scope, report)
    current: _LocalVersions | _RecordedVersions
    if options.paths and not split_recordings(options.paths, root)[1]:
        later = topics_of(read_source, options.paths, (), root, report)
        current = _RecordedVersions(later or (), local, report)
    else:
        files = find(options.paths, root, report, options.scope.exclude)
        problems = Report()
        packages = inputs.packages(files, options.scope, problems)
        report.extend(problems)
        current = _LocalVersions(packages, options, local, report)
    topics = topics_of(read_source, recordings, (), root, report)
    if topics is None or report.had_errors:
        return None
    changes: dict[object, Change] = {}
    seen: set[ir.TypeName] = set()
    for version in versions(topics):
        types = recorded_types(version, local, report)
        models = types.models.values()
        report.extend(types.errors)
        for old, new in current.pairs(models, types.texts):
            seen |= {interface.name for interface in old.own}
            with stage("compare", old.package):
                new_ones = current.compared(old, new).changes
            changes = {
                **{(change.subject, change.message): change for change in new_ones},
                **changes,
            }
    if current.unknown:
        names = first_few((f"`{name}`" for name in sorted(current.unknown)), NAMED)
        report.notes.append(
            f"idlc did not find these interfaces, and did not compare them: {names}"
        )
    if not seen:
        message = "idlc compared no interface with the recordings"
        hint = "name the folder of the interfaces that were recorded, or a second recording"
        report.add(codes.NO_INTERFACES.of(options.against, message, hint=hint))
    counts = {"interface": len(seen), "recording": len(recordings)}
    judged = judge([*changes.values()], options, report, concerns=concerns_readers)
    others, hidden = (0, judged.hidden) if options.levels else (judged.hidden, 0)
    return RecordedVerdict(judged.levels, judged.allowed, others, counts, hidden)


class _RecordedVersions:
    """The versions of other recordings, to compare recordings with."""

    def __init__(
        self, topics: Iterable[RecordedDefinition], local: LocalTypes, report: Report
    ) -> None:
        self._models: dict[str, list[Model]] = {}
        #: Interfaces that could not be compared.
        self.unknown: set[ir.TypeName] = set()
        for version in versions(topics):
            types = recorded_types(version, local, report)
            report.extend(types.errors)
            for model in types.models.values():
                self._models.setdefault(model.package, []).append(model.only(types.texts))

    def pairs(
        self, models: Iterable[Model], recorded: Container[ir.TypeName]
    ) -> Iterator[tuple[Model, Model]]:
        """Yield each recorded package, and each later version of the same interfaces."""
        for model in models:
            old = model.only(recorded)
            missing = _names(old)
            for new in self._models.get(model.package, ()):
                missing -= _names(new)
                yield old.only(_names(new)), new.only(_names(old))
            self.unknown |= missing

    def compared(self, old: Model, new: Model) -> Comparison:
        """Return the changes."""
        return compare(old, new)


class _LocalVersions:
    """The versions to compare recordings with: the user's files, or else this machine's types."""

    def __init__(
        self,
        packages: Sequence[inputs.Inputs],
        options: BreakingOptions,
        local: LocalTypes,
        report: Report,
    ) -> None:
        self.types = local
        self._root = options.scope.root
        self._packages = {package.package: package for package in packages}
        self._models = error_free_models(packages, options.scope, report)
        #: Interfaces that could not be compared.
        self.unknown: set[ir.TypeName] = set()

    def pairs(
        self, models: Iterable[Model], recorded: Container[ir.TypeName]
    ) -> Iterator[tuple[Model, Model]]:
        """Yield each recorded package, and the local version of the same interfaces."""
        for model in models:
            old = model.only(recorded)
            if not self._packages:
                new = self.types.model(model.package, _names(old))
                self.unknown |= _names(old) - _names(new)
            elif model.package in self._packages:
                new = self._models[model.package]
                if self._packages[model.package].is_whole(self._root):
                    yield old, new  # missing interfaces were removed
                    continue
            else:
                continue
            yield old.only(_names(new)), new.only(_names(old))

    def compared(self, old: Model, new: Model) -> Comparison:
        """Return the changes, with the path of the missing file for removed interfaces."""
        comparison, package = compare(old, new), self._packages.get(old.package)
        if package is None:
            return comparison
        home = self._root.shown(package.home)
        return comparison.placed(lambda path: f"{home}/{path.rpartition(f'{old.package}/')[2]}")


def _names(model: Model) -> set[ir.TypeName]:
    return {interface.name for interface in model.own}


def concerns_readers(change: Change) -> bool:
    """Return whether a change affects readers of earlier recordings.

    Bytes are misread or unreadable, a type is not found, or values have another meaning. Default
    values have no effect: no reader uses them.
    """
    if change.code in (codes.INTERFACE_RENAMED, codes.FIELD_DEFAULT_CHANGED):
        return change.code is codes.INTERFACE_RENAMED
    return bool(change.levels & {"wire", "behaviour"})
