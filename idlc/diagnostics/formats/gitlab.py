"""A report as GitLab's code quality report."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable

from idlc.diagnostics.formats import Run
from idlc.diagnostics.report import Diagnostic, Severity


def gitlab(diagnostics: Iterable[Diagnostic], _: Run) -> str:
    """Return the JSON document."""
    seen: dict[str, int] = {}
    return json.dumps([_issue(one, seen) for one in diagnostics], indent=2) + "\n"


def _issue(one: Diagnostic, seen: dict[str, int]) -> dict[str, object]:
    line = one.span.source.position(one.span.start)[0] if one.span and not one.within else 1
    return {
        "type": "issue",
        "check_name": one.code,
        "description": "; ".join(
            filter(None, (one.message, one.breaks, one.holds_for, one.within))
        ),
        "severity": "major" if one.severity is Severity.ERROR else "minor",
        "fingerprint": fingerprint(one, seen),
        "location": {"path": one.file or ".", "lines": {"begin": line}},
    }


def fingerprint(one: Diagnostic, seen: dict[str, int]) -> str:
    """Return what tells a problem from all others, and stays when lines move.

    `seen` counts those that are alike but for their place.
    """
    key = "\0".join((one.code, one.file, one.message))
    number = seen[key] = seen.get(key, 0) + 1
    return hashlib.sha256(f"{key}\0{number}".encode("utf-8", "replace")).hexdigest()[:32]
