"""The problems of recordings: `idlc check REC`."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from idlc.api.sources import read_source
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, Severity
from idlc.project.settings import Scope
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
