"""The pipeline of `idlc breaking --against REC`: changes since a recording was made."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Sequence
from contextlib import suppress
from itertools import chain
from typing import NamedTuple

import msgspec

from idlc.api.sources import read_source
from idlc.compiler.compiler import stage
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, ReportedError
from idlc.model import ir
from idlc.model.link import Model
from idlc.project import inputs
from idlc.project.find import find
from idlc.recordings.definitions import RecordedDefinition
from idlc.recordings.types import (
    DefinedTopic,
    LocalTypes,
    RecordedTypes,
    recorded_types,
    topics_of,
    versions,
)
from idlc.tasks.breaking.files import (
    BreakingOptions,
    error_free_models,
    judge,
    report_nothing,
    report_skipped,
)
from idlc.versions.changes import Change
from idlc.versions.packages import Comparison, Skipped, compare


class RecordedVerdict(NamedTuple):
    """The result: the number of changes by broken level, and of compared items by kind.

    `others` counts changes without effect on readers if no level was selected, `hidden` changes
    that break only other levels than the selected ones. `not_compared` are types and topics.
    """

    levels: dict[str, int]
    allowed: int
    others: int
    seen: dict[str, int]
    hidden: int
    not_compared: tuple[str, ...]


def compare_with_recordings(
    options: BreakingOptions, recordings: Sequence[str], newer: Sequence[str], report: Report
) -> RecordedVerdict:
    """Report changes since recordings were made; ReportedError if something cannot be read.

    The new versions are in the `newer` recordings, in the interfaces of PATHs, or without both on
    this machine. Without levels, only changes that affect readers are reported.
    """
    files = find(options.paths, options.scope.root, report, options.scope.exclude)
    problems = Report()
    packages = inputs.packages(files, options.scope, problems)
    report.extend(problems)
    topics: list[list[RecordedDefinition]] = []
    for words in (recordings, newer):
        with suppress(ReportedError):  # both are read before an error ends this
            topics.append(topics_of(read_source, words, (), options.scope.root, report))
    report.raise_errors()
    local = _LocalVersions(packages, options, report)
    later = _Recorded(topics[1], local.types, report) if newer else None
    earlier = _Recorded(topics[0], local.types, report)
    changes: dict[object, Change] = {}
    seen: set[ir.TypeName] = set()
    for models, recorded in earlier.versions:
        for old, new in (later or local).pairs(models, recorded):
            seen |= {interface.name for interface in old.own}
            with stage("compare", old.package):
                new_ones = local.compared(old, new).changes
            changes = {
                **{(change.subject, change.message): change for change in new_ones},
                **changes,
            }
    skipped = [*_skipped(earlier, later, local, seen)]
    if not seen:
        reason = "the recordings contain none of these interfaces"
        hint = "`idlc show` lists the types of a recording; name the folder of these interfaces"
        report_nothing(options, reason, hint, report)
    names = report_skipped(skipped, options, report)
    counts = {"interface": len(seen), "recording": len(recordings) + len(newer)}
    judged = judge([*changes.values()], options, report, concerns=concerns_readers)
    others, hidden = (0, judged.hidden) if options.levels else (judged.hidden, 0)
    return RecordedVerdict(judged.levels, judged.allowed, others, counts, hidden, names)


def _skipped(
    earlier: _Recorded, later: _Recorded | None, local: _LocalVersions, seen: set[ir.TypeName]
) -> Iterator[Skipped]:
    """Yield the types and topics that were not compared, with the reasons."""
    undefined = earlier.undefined
    if later:
        yield Skipped(_sorted(earlier.names - seen), "absent from the other recordings")
    else:
        yield Skipped(_sorted(local.unknown), "not found")
        if local.packages:  # what else was recorded is not meant
            undefined = {
                topic: name
                for topic, name in undefined.items()
                if name and name.package in local.packages
            }
    yield Skipped(tuple(sorted(undefined)), "the recording contains no definition")
    if later:
        yield Skipped(tuple(sorted(later.undefined)), "the recording contains no definition")


def _sorted(names: Iterable[ir.TypeName]) -> tuple[str, ...]:
    return tuple(map(str, sorted(names)))


class _Recorded:
    """The versions of types in recordings: for each, its models and the definitions in them.

    `undefined` are topics, each with the name of its type, without a definition to compare.
    """

    def __init__(
        self, topics: Sequence[RecordedDefinition], local: LocalTypes, report: Report
    ) -> None:
        self.versions: list[tuple[list[Model], Container[ir.TypeName]]] = []
        self.undefined: dict[str, ir.TypeName | None] = {}
        for version in versions(topics):
            types = recorded_types(version, local, report)
            report.extend(types.errors)
            self.versions.append((list(types.models.values()), types.texts))
            defined = {
                typed.recorded.topic.name for typed in types.topics if _is_sure(typed, types)
            }
            self.undefined |= {
                topic.topic.name: topic.interface
                for topic in version.topics
                if topic.topic.name not in defined
            }

    @property
    def names(self) -> set[ir.TypeName]:
        """The names of all defined interfaces."""
        every = chain.from_iterable(models for models, _ in self.versions)
        return {name for model in every for name in _names(model)}

    def pairs(
        self, models: Iterable[Model], recorded: Container[ir.TypeName]
    ) -> Iterator[tuple[Model, Model]]:
        """Yield each package of an older version, and each newer version of its interfaces."""
        for old in (model.only(recorded) for model in models):
            for newer, texts in self.versions:
                for new in (each.only(texts) for each in newer if each.package == old.package):
                    if shared := _names(old) & _names(new):
                        yield old.only(shared), new.only(shared)


def _is_sure(typed: DefinedTopic, types: RecordedTypes) -> bool:
    """Return whether the recorded type is known: by its definition, or by its hash."""
    digest = typed.recorded.topic.hash
    return typed.interface in types.texts or bool(digest and digest == types.hash(typed))


class _LocalVersions:
    """The versions to compare recordings with: the user's files, or else this machine's types."""

    def __init__(
        self, packages: Sequence[inputs.Inputs], options: BreakingOptions, report: Report
    ) -> None:
        scope = options.scope
        homes = tuple(package.home.as_posix() for package in packages)
        near = msgspec.structs.replace(scope, include=(*homes, *scope.include))
        self.types = LocalTypes(near, report)
        self._root = options.scope.root
        self.packages = {package.package: package for package in packages}
        self._models = error_free_models(packages, options.scope, report)
        #: Interfaces that could not be compared.
        self.unknown: set[ir.TypeName] = set()

    def pairs(
        self, models: Iterable[Model], recorded: Container[ir.TypeName]
    ) -> Iterator[tuple[Model, Model]]:
        """Yield each recorded package, and the local version of the same interfaces."""
        for model in models:
            old = model.only(recorded)
            if not self.packages:
                new = self.types.model(model.package, _names(old))
                self.unknown |= _names(old) - _names(new)
            elif model.package in self.packages:
                new = self._models[model.package]
                if self.packages[model.package].is_whole(self._root):
                    yield old, new  # missing interfaces were removed
                    continue
            else:
                continue
            yield old.only(_names(new)), new.only(_names(old))

    def compared(self, old: Model, new: Model) -> Comparison:
        """Return the changes, with the path of the missing file for removed interfaces."""
        comparison, package = compare(old, new), self.packages.get(old.package)
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
