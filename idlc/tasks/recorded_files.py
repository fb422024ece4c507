"""The definitions in a recording as the files of packages: `idlc show REC --format msg`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from idlc.api.sources import read_source
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.project import write
from idlc.project.settings import Scope
from idlc.recordings.packages import check_versions
from idlc.recordings.types import topics_of, versions


def write_definitions(
    recording: str, topics: Sequence[str], out: str, scope: Scope, report: Report
) -> list[str]:
    """Write each definition of a recording, or of some topics, to its file; return their paths.

    Files that exist with another content are an error, and nothing is written.
    """
    groups = versions(topics_of(read_source, [recording], topics, scope.root, report) or ())
    check_versions(groups, report)
    if report.had_errors:
        return []
    files: dict[str, bytes] = {}
    for name, source in groups[0].texts.items() if groups else ():
        suffix = "idl" if source.is_idl else name.kind
        files[f"{name.package}/{name.kind}/{name.name}.{suffix}"] = source.text.encode()
    if not files:
        report.add(codes.NO_INTERFACES.of(recording, f"`{recording}` contains no definitions"))
        return []
    folder, shown = Path(scope.root.path(out)).absolute(), out.rstrip("/")
    changes = write.compare(folder, shown, files, {}, report)
    for change in changes:
        if change.old is not None:
            path = write.shown(shown, change.path)
            hint = "choose another folder with -o"
            report.add(codes.EXISTING_FILE.of(path, f"`{path}` exists", hint=hint))
    plan = write.Plan(folder, tuple(changes), {})
    if report.had_errors or not write.apply(plan, shown, report):
        return []
    return [write.shown(shown, path) for path in files]
