"""The pipeline of `idlc breaking --against REC`: whether what was recorded can still be read."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Sequence
from typing import NamedTuple

from idlc.check.compiler import stage
from idlc.compare.breaking import BreakingOptions, not_allowed, sound_ones
from idlc.compare.changes import LEVELS, Change
from idlc.compare.packages import compare
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, first_few
from idlc.model import ir
from idlc.model.link import Model
from idlc.project import inputs
from idlc.project.find import look, nothing_in
from idlc.recordings.types import NAMED, Around, recorded_types
from idlc.recordings.versions import topics_of, versions


class RecordedVerdict(NamedTuple):
    """What came out: how many changes break each level, and all that was looked at.

    `others` is how many changes are none for readers, where no level was asked for; otherwise
    `hidden` is how many break other levels.
    """

    levels: dict[str, int]
    allowed: int
    others: int
    seen: dict[str, int]
    hidden: int


def compare_with_recordings(
    options: BreakingOptions, recordings: Sequence[str], report: Report
) -> RecordedVerdict | None:
    """Report what changed since recordings were made; `None` if something could not be read.

    Compared are the interfaces of PATHs, or without any those that are known here. Without levels,
    only what concerns readers is reported.
    """
    there = look(options.paths, options.scope.root, report, options.scope.exclude)
    report.extend(nothing_in(one, options.scope.root, options.scope.exclude) for one in there.empty)
    found = Report()
    given = inputs.packages(there.files, options.scope, found)
    report.extend(found)
    topics = topics_of(recordings, (), report)
    if topics is None or report.had_errors:
        return None
    here = _Here(given, options, report)
    changes: dict[object, Change] = {}
    seen: set[ir.TypeName] = set()
    for version in versions(topics):
        types = recorded_types(version, here.around, options.scope, report)
        models = types.models.values()
        report.extend(types.errors)
        for old, new in here.pairs(models, types.texts):
            seen |= {one.name for one in old.own}
            with stage("compare", old.package):
                new_ones = here.placed(compare(old, new).changes, old.package)
            changes = {**{(one.subject, one.message): one for one in new_ones}, **changes}
    here.tell(report)
    if given and not seen:
        report.notes.append("none of these interfaces was recorded")
    counts = {"interface": len(seen), "recording": len(recordings)}
    return _verdict(list(changes.values()), options, counts, report)


class _Here:
    """The versions that recordings are compared with: those given, or else those known here."""

    def __init__(
        self, given: Sequence[inputs.Inputs], options: BreakingOptions, report: Report
    ) -> None:
        self.around = Around(options.scope, report)
        self._root = options.scope.root
        self._given = {one.package: one for one in given}
        self._models = sound_ones(given, options.scope, report)
        self._unknown: set[ir.TypeName] = set()

    def pairs(
        self, models: Iterable[Model], recorded: Container[ir.TypeName]
    ) -> Iterator[tuple[Model, Model]]:
        """Yield what recordings define of each package, and the version of that here."""
        for model in models:
            old = model.only(recorded)
            if not self._given:
                new = self.around.model(model.package, _names(old))
                self._unknown |= _names(old) - _names(new)
            elif model.package in self._given:
                new = self._models[model.package]
                if self._given[model.package].is_whole(self._root):
                    yield old, new  # what is not there was removed
                    continue
            else:
                continue
            yield old.only(_names(new)), new.only(_names(old))

    def placed(self, changes: Iterable[Change], package: str) -> list[Change]:
        """Return changes, those of what was removed with the place where it would be."""
        given = self._given.get(package)
        home = self._root.shown(given.home) if given else ""
        return [
            one._replace(place=f"{home}/{one.path.rpartition(f'{package}/')[2]}")
            if given and not one.span
            else one
            for one in changes
        ]

    def tell(self, report: Report) -> None:
        """Note what could not be compared."""
        if self._unknown:
            names = first_few((f"`{name}`" for name in sorted(self._unknown)), NAMED)
            report.notes.append(f"not known here, so not compared: {names}")


def _names(model: Model) -> set[ir.TypeName]:
    return {one.name for one in model.own}


def _verdict(
    changes: Sequence[Change],
    options: BreakingOptions,
    seen: dict[str, int],
    report: Report,
) -> RecordedVerdict:
    left = not_allowed(changes, options, report)
    asked = set(options.levels)
    wanted = [one for one in left if (one.levels & asked if asked else concerns_readers(one))]
    report.extend(change.diagnostic for change in wanted)
    return RecordedVerdict(
        {level: sum(level in change.levels for change in wanted) for level in LEVELS},
        len(changes) - len(left),
        0 if asked else len(left) - len(wanted),
        seen,
        len(left) - len(wanted) if asked else 0,
    )


def concerns_readers(change: Change) -> bool:
    """Return whether a change is one for those who read what was recorded before.

    Bytes are read wrongly or not at all, a type is not found, or values mean something else.
    Default values do not: no reader uses them.
    """
    if change.code in (codes.INTERFACE_RENAMED, codes.FIELD_DEFAULT_CHANGED):
        return change.code is codes.INTERFACE_RENAMED
    return bool(change.levels & {"wire", "behaviour"})
