"""Writing a site: only files that an earlier run wrote are replaced or removed."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Mapping
from pathlib import Path, PurePosixPath

from idlc.disk.read import reason
from idlc.text import codes
from idlc.text.diagnostics import Report

LISTING = "idlc-docs.json"


def write(out: str, files: Mapping[str, str], report: Report) -> bool:
    """Write files below `out`; report IDL612 or IDL614 and return `False` if that must not be."""
    folder = Path(out)
    before = _listed(folder)
    foreign = [path for path in files if path not in before and (folder / path).exists()]
    for path in foreign:
        shown = f"{out}/{path}"
        report.add(
            codes.FOREIGN_FILE.of(
                shown, f"`{shown}` was not written by idlc", hint="choose another folder with -o"
            )
        )
    if foreign:
        return False
    try:
        for path, text in {**files, LISTING: json.dumps(sorted(files), indent=1) + "\n"}.items():
            target = folder / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(text, encoding="utf-8", newline="\n")
        for path in before - files.keys():
            (folder / path).unlink(missing_ok=True)
            with contextlib.suppress(OSError):
                (folder / path).parent.rmdir()
    except OSError as error:
        report.add(codes.CANNOT_WRITE.of(out, f"cannot write to `{out}`: {reason(error)}"))
        return False
    return True


def _listed(folder: Path) -> set[str]:
    try:
        listed = json.loads((folder / LISTING).read_bytes())
    except (OSError, ValueError):
        return set()
    paths = [path for path in listed if isinstance(path, str)] if isinstance(listed, list) else []
    return {path for path in paths if ".." not in PurePosixPath(path).parts and path[:1] != "/"}
