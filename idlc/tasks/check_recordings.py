"""The problems of recordings: `idlc check REC`."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress

import msgspec

from idlc.api.recording import RecordedTopic, Recording
from idlc.api.sources import read_source
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, Severity
from idlc.model.distros import Distro
from idlc.project.settings import Scope
from idlc.project.words import is_address
from idlc.recordings.containers.source import RecordingError, is_local
from idlc.recordings.lengths import WrongDefinitionError
from idlc.recordings.load import MissingDefinitionWarning, OtherDefinitionWarning
from idlc.recordings.packages import check_versions, contradicted
from idlc.recordings.types import LocalTypes, damage_problems, recorded_types, versions


def check_recordings(paths: Sequence[str], scope: Scope, report: Report) -> None:
    """Report damage of recordings, and problems in their type definitions."""
    local = LocalTypes(scope, report)
    for path in paths:
        recording = read_source(path, scope.root, report, check=True, verify=True)
        groups = versions(recording.topics) if recording else []
        for message, hint in recording.unread if recording else ():
            problem = codes.UNREADABLE_RECORDING.of(path, message, hint=hint)
            report.add(msgspec.structs.replace(problem, severity=Severity.WARNING))
        report.extend(damage_problems(path, recording.damage) if recording else ())
        check_versions(groups, report)
        for version in groups:
            types = recorded_types(version, local, report)
            report.extend(contradicted(types))
            report.extend(types.errors)
        if recording is not None and not is_address(path):
            _check_lengths(path, scope, report)


def _check_lengths(path: str, scope: Scope, report: Report) -> None:
    """Report topics whose messages are of another version than their definition."""

    def judge(topic: RecordedTopic) -> None:
        try:
            topic.compare_lengths()
        except WrongDefinitionError as error:
            report.add(codes.UNREADABLE_RECORDING.of(path, error.message, hint=error.hint))

    for message in _warnings(path, scope, judge):
        if isinstance(message, OtherDefinitionWarning) and "bytes" in str(message):
            report.add(codes.RECORDED_HASH_DIFFERS.of(path, str(message)))
        if isinstance(message, MissingDefinitionWarning) and message.distro:
            report.notes.append(_fitting(message.topic, message.distro, "check"))


def note_fitting(paths: Iterable[str], scope: Scope, report: Report) -> None:
    """Add a note for each undefined topic whose messages only fit the type of a distribution."""

    def judge(topic: RecordedTopic) -> None:
        if topic.topic.schema is None:
            _ = topic.structure

    for path in paths:
        for message in () if is_address(path) else _warnings(path, scope, judge):
            if isinstance(message, MissingDefinitionWarning) and message.distro:
                report.notes.append(_fitting(message.topic, message.distro, "generate"))


def _warnings(
    path: str, scope: Scope, judge: Callable[[RecordedTopic], None]
) -> list[Warning | str]:
    """Return the warnings as each definition of a recording is judged."""
    distro = scope.distros[0].name if scope.distros else None
    place = scope.root.path(path) if is_local(path) else path
    with (
        warnings.catch_warnings(record=True) as caught,
        Recording(place, include=scope.include, distro=distro) as recording,
    ):
        warnings.simplefilter("always")
        for topic in recording.definitions():
            with suppress(RecordingError):  # its definition has problems, or cannot be read
                judge(topic)
    return [warning.message for warning in caught]


def _fitting(topic: str, distro: Distro, verb: str) -> str:
    """Return the note about a distribution whose type messages fit."""
    fitting = f"they fit the type of ROS 2 {distro.title}"
    what = f"messages of `{topic}` do not fit the local type, but {fitting}"
    return f"{what}: {verb} with `--distro {distro.name}`"
