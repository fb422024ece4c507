"""A report as SARIF 2.1.0, as code scanning services read it."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterable
from urllib.parse import quote

from idlc.diagnostics.code_pages import page
from idlc.diagnostics.codes import CODES
from idlc.diagnostics.formats import Run
from idlc.diagnostics.formats.gitlab import fingerprint
from idlc.diagnostics.report import Diagnostic, Edit, Severity
from idlc.diagnostics.source import Span

SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"


def sarif(diagnostics: Iterable[Diagnostic], run: Run) -> str:
    """Return the JSON document; services keep those of several commands apart."""
    found = list(diagnostics)
    codes = sorted({one.code for one in found})
    seen: dict[str, int] = {}
    whole = {
        "tool": {
            "driver": {
                "name": "idlc",
                "version": run.version,
                "rules": [_rule(code) for code in codes],
            }
        },
        "automationDetails": {"id": f"idlc/{run.command}/"},
        "columnKind": "unicodeCodePoints",
        "results": [_result(one, codes.index(one.code), seen) for one in found],
    }
    return json.dumps({"$schema": SCHEMA, "version": "2.1.0", "runs": [whole]}, indent=2) + "\n"


def _rule(code: str) -> dict[str, object]:
    known = CODES.get(code)
    if known is None:
        return {"id": code}
    text = page(code) or ""
    first = text.split("\n\n")[1] if text.count("\n\n") else known.slug
    plain = " ".join(first.replace("`", "").split())
    return {
        "id": code,
        "name": "".join(word.capitalize() for word in re.split(r"\W", known.slug)),
        "shortDescription": {"text": plain},
        "help": {"text": plain, "markdown": text or plain},
        "defaultConfiguration": {"level": _level(known.severity)},
    }


def _level(severity: Severity) -> str:
    return "error" if severity is Severity.ERROR else "warning"


def _result(one: Diagnostic, rule: int, seen: dict[str, int]) -> dict[str, object]:
    text = "; ".join(filter(None, (one.message, one.breaks, one.holds_for, one.hint, one.within)))
    result: dict[str, object] = {
        "ruleId": one.code,
        "ruleIndex": rule,
        "level": _level(one.severity),
        "message": {"text": text},
        "partialFingerprints": {"idlc/v1": fingerprint(one, seen)},
    }
    if one.file:
        result["locations"] = [_location(one.span, one.file)]
    if one.labels:
        result["relatedLocations"] = [
            {**_location(label.span, label.span.source.file), "message": {"text": label.text}}
            for label in one.labels
        ]
    if one.edits:
        result["fixes"] = [{"artifactChanges": [_change(edit) for edit in one.edits]}]
    return result


def _location(span: Span | None, path: str) -> dict[str, object]:
    place: dict[str, object] = {"artifactLocation": _artifact(path)}
    if span is not None and span.source.path == path:
        place["region"] = _physical_region(span)
    return {"physicalLocation": place}


def _artifact(path: str) -> dict[str, str]:
    if path.startswith("/"):
        return {"uri": "file://" + quote(path, errors="replace")}
    if sys.platform == "win32" and re.match("[A-Za-z]:/", path):  # on a drive
        return {"uri": "file:///" + quote(path, safe="/:", errors="replace")}
    return {"uri": quote(path, errors="replace")}


def _physical_region(span: Span) -> dict[str, int]:
    line, column = span.source.position(span.start)
    end_line, end_column = span.source.position(span.end)
    return {"startLine": line, "startColumn": column, "endLine": end_line, "endColumn": end_column}


def _change(edit: Edit) -> dict[str, object]:
    return {
        "artifactLocation": _artifact(edit.span.source.path),
        "replacements": [
            {"deletedRegion": _physical_region(edit.span), "insertedContent": {"text": edit.text}}
        ],
    }
