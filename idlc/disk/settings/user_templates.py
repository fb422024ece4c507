"""The templates that a user has written: files of a folder, by their names."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.disk.read import absolute, is_folder, read_source


def read(folder: str, below: Iterable[str], ending: str, report: Report) -> dict[str, Source]:
    """Return the files with an ending in a folder and in some folders of it, by `folder/name`.

    What cannot be read is reported.
    """
    path = absolute(folder)
    if not is_folder(path):
        message = f"no such folder: `{folder}`, which is to hold templates"
        hint = "`idlc scaffold templates --copy NAME` starts one"
        report.add(codes.NO_SUCH_PATH.of(folder, message, hint=hint))
        return {}
    found = {}
    for prefix in ("", *(f"{one}/" for one in sorted(below))):
        for file in _files(path / prefix, ending):
            name = f"{prefix}{file.name}"
            source = read_source(file, f"{folder}/{name}", report)
            if source is not None:
                found[name] = source
    return found


def _files(folder: Path, ending: str) -> list[Path]:
    try:
        return sorted(path for path in folder.iterdir() if path.name.endswith(ending))
    except OSError:
        return []
