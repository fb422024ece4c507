"""Recordings for the commands that check and answer: each by itself, all that it defines."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Label, Report, Severity
from idlc.diagnostics.source import Span
from idlc.diagnostics.suggest import including
from idlc.disk.scope import Scope
from idlc.driver.recordings.types import Around, RecordedTypes, recorded_types
from idlc.driver.recordings.versions import Version, contradictions, read, versions
from idlc.driver.stages import derived_names

if TYPE_CHECKING:
    from idlc.model.link import Model


def check_recordings(paths: Sequence[str], scope: Scope, report: Report) -> None:
    """Report what is wrong with what recordings say of their types."""
    around = Around(scope, report)
    for path in paths:
        recording = read(path, report, look=True)
        found = versions(recording.topics) if recording else []
        for message, hint in recording.unread if recording else ():
            problem = codes.UNREADABLE_RECORDING.of(path, message, hint=hint)
            report.add(msgspec.structs.replace(problem, severity=Severity.WARNING))
        check_versions(found, report)
        for version in found:
            types = recorded_types(version, around, scope, report)
            report.extend(contradicted(types))
            report.extend(types.errors)


def check_versions(found: Sequence[Version], report: Report) -> None:
    """Report IDL653 for each name with several definitions."""
    for name, first, second in contradictions(found):
        report.add(
            codes.SEVERAL_DEFINITIONS.at(
                Span(second, 0, 0),
                f"this defines `{name}` in another way",
                labels=(Label(Span(first, 0, 0), "this is the other"),),
                hint="choose topics that agree, or one recording after the other",
            )
        )


def contradicted(types: RecordedTypes) -> Iterator[Diagnostic]:
    """Yield IDL654 for each topic whose definition is not that of what was recorded."""
    for one in types.topics:
        topic, hash_ = one.recorded.topic, types.hash(one)
        if topic.hash and hash_ and topic.hash != hash_:
            yield codes.RECORDED_HASH_DIFFERS.of(
                f"{one.recorded.recording}: topic {topic.name}",
                f"the definition of `{one.name}` is not that of what was recorded",
                hint=f"{including('DIR')} with the files that the publisher used",
                place=one.recorded.recording,
                detail=f"type hash recorded  {topic.hash}\nof the definition   {hash_}",
            )


def recorded_models(
    paths: Sequence[str], scope: Scope, report: Report
) -> Iterator[tuple[Model, list[str]]]:
    """Yield the models of recordings, without what has errors, and the names of all in them."""
    around = Around(scope, report)
    for path in paths:
        recording = read(path, report)
        for version in versions(recording.topics) if recording else ():
            types = recorded_types(version, around, scope, report)
            for model in types.models.values():
                yield model, [name for one in model.own for name in derived_names(one)]
            report.extend(types.errors)
