"""Reports as the documents that CI systems read; `terminal` has text and JSON lines."""

from __future__ import annotations

import hashlib
import json
import re
import sys
from collections.abc import Iterable
from typing import NamedTuple
from urllib.parse import quote
from xml.sax.saxutils import escape, quoteattr

from idlc.diagnostics.codes import CODES
from idlc.diagnostics.explain import page
from idlc.diagnostics.report import Diagnostic, Severity
from idlc.diagnostics.source import Span
from idlc.diagnostics.text import one_line


class RunFacts(NamedTuple):
    """The facts of a document besides problems: the command, idlc's version and the files read.

    With `strict`, warnings fail as errors do.
    """

    command: str
    version: str
    files: tuple[str, ...] = ()
    strict: bool = False


def github(diagnostics: Iterable[Diagnostic], _: RunFacts) -> str:
    """Return one command for each problem."""
    return "".join(map(_command, diagnostics))


def _command(diagnostic: Diagnostic) -> str:
    slug = CODES[diagnostic.code].slug
    region = {}
    if diagnostic.span is not None and not diagnostic.within:
        line, column, end_line, end_column = diagnostic.span.corners
        region = {"line": line, "endLine": end_line}
        # GitHub shows columns only for places within one line
        if end_line == line:
            region |= {"col": column, "endColumn": end_column}
    facts = {"file": diagnostic.file, **region, "title": f"{diagnostic.code} {slug}"}
    listed = ",".join(
        f"{key}={_property(one_line(str(value)))}" for key, value in facts.items() if value
    )
    text = "\n".join(map(one_line, diagnostic.sentences()))
    return f"::{diagnostic.severity.name.lower()} {listed}::{_escaped(text)}\n"


def notice(title: str, text: str) -> str:
    """Return a command that shows a line about the whole run."""
    return f"::notice title={_property(one_line(title))}::{_escaped(one_line(text))}\n"


def _escaped(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _escaped(text).replace(":", "%3A").replace(",", "%2C")


def gitlab(diagnostics: Iterable[Diagnostic], _: RunFacts) -> str:
    """Return the JSON document."""
    seen: dict[str, int] = {}
    issues = []
    for diagnostic in diagnostics:
        line = diagnostic.span.corners[0] if diagnostic.span and not diagnostic.within else 1
        issue = {
            "type": "issue",
            "check_name": diagnostic.code,
            "description": "; ".join(diagnostic.sentences(hint=False)),
            "severity": "major" if diagnostic.severity is Severity.ERROR else "minor",
            "fingerprint": fingerprint(diagnostic, seen),
            "location": {"path": diagnostic.file or ".", "lines": {"begin": line}},
        }
        issues.append(issue)
    return json.dumps(issues, indent=2) + "\n"


def fingerprint(diagnostic: Diagnostic, seen: dict[str, int]) -> str:
    """Return a text that is unique to a problem, and stays when lines move.

    `seen` counts problems that differ in their location only.
    """
    key = "\0".join((diagnostic.code, diagnostic.file, diagnostic.message))
    number = seen[key] = seen.get(key, 0) + 1
    return hashlib.sha256(f"{key}\0{number}".encode("utf-8", "replace")).hexdigest()[:32]


_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit(diagnostics: Iterable[Diagnostic], run: RunFacts) -> str:
    """Return the XML document: a test for each problem, and a passed one for each clean file.

    A warning is a passed test with output, unless it fails the run as well: servers would fail a
    build whose exit status is 0.
    """
    reported = list(diagnostics)
    failed = [run.strict or diagnostic.severity is Severity.ERROR for diagnostic in reported]
    dirty = {diagnostic.where[0] for diagnostic in reported}
    clean = [file for file in run.files if file not in dirty]
    head = (
        f'<testsuite name="idlc" tests="{len(reported) + len(clean)}" '
        f'failures="{sum(failed)}" errors="0" skipped="0">'
    )
    cases = list(map(_case, reported, failed))
    cases += [f'  <testcase classname="idlc" name={_quoted(file)}/>' for file in clean]
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', head, *cases, "</testsuite>", ""]
    # ASCII reads the same in whichever encoding it is written
    return "\n".join(lines).encode("ascii", "xmlcharrefreplace").decode("ascii")


def _case(diagnostic: Diagnostic, failed: bool) -> str:
    path = diagnostic.where[0]
    line = ":{}:{}".format(*diagnostic.span.corners) if diagnostic.span else ""
    hint = f"hint: {diagnostic.hint}" if diagnostic.hint else ""
    parts = (f"{path}{line}: {diagnostic.message}", diagnostic.breaks, diagnostic.holds_for, hint)
    text = "\n".join(one_line(part) for part in parts if part)
    name = f"{diagnostic.code} {CODES[diagnostic.code].slug}{line}"
    kind = diagnostic.severity.name.lower()
    tag = f"failure type={_quoted(kind)} message={_quoted(diagnostic.message)}"
    if not failed:
        tag, text = "system-out", f"{kind}: {text}"
    return (
        f"  <testcase classname={_quoted(path or 'idlc')} name={_quoted(name)}>\n"
        f"    <{tag}>{escape(_legal(text))}</{tag.split()[0]}>\n"
        "  </testcase>"
    )


def _quoted(text: str) -> str:
    return quoteattr(_legal(one_line(text)))


def _legal(text: str) -> str:
    return _NOT_XML.sub("\N{REPLACEMENT CHARACTER}", text)


SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"


def sarif(diagnostics: Iterable[Diagnostic], run: RunFacts) -> str:
    """Return the JSON document; services keep those of several commands apart."""
    reported = list(diagnostics)
    codes = sorted({diagnostic.code for diagnostic in reported})
    seen: dict[str, int] = {}
    rules = [_rule(code) for code in codes]
    whole = {
        "tool": {"driver": {"name": "idlc", "version": run.version, "rules": rules}},
        "automationDetails": {"id": f"idlc/{run.command}/"},
        "columnKind": "unicodeCodePoints",
        "results": [
            _result(diagnostic, codes.index(diagnostic.code), seen) for diagnostic in reported
        ],
    }
    return json.dumps({"$schema": SCHEMA, "version": "2.1.0", "runs": [whole]}, indent=2) + "\n"


def _rule(code: str) -> dict[str, object]:
    kind = CODES[code]
    text = page(code) or ""
    plain = " ".join(text.split("\n\n")[1].replace("`", "").split())
    return {
        "id": code,
        "name": "".join(word.capitalize() for word in re.split(r"\W", kind.slug)),
        "shortDescription": {"text": plain},
        "help": {"text": plain, "markdown": text},
        "defaultConfiguration": {"level": kind.severity.name.lower()},
    }


def _result(diagnostic: Diagnostic, rule: int, seen: dict[str, int]) -> dict[str, object]:
    result: dict[str, object] = {
        "ruleId": diagnostic.code,
        "ruleIndex": rule,
        "level": diagnostic.severity.name.lower(),
        "message": {"text": "; ".join(diagnostic.sentences())},
        "partialFingerprints": {"idlc/v1": fingerprint(diagnostic, seen)},
    }
    if diagnostic.file:
        result["locations"] = [_location(diagnostic.span, diagnostic.file)]
    if diagnostic.labels:
        result["relatedLocations"] = [
            {**_location(label.span, label.span.source.file), "message": {"text": label.text}}
            for label in diagnostic.labels
        ]
    if diagnostic.edits:
        changes = []
        for edit in diagnostic.edits:
            region = _physical_region(edit.span)
            replacement = {"deletedRegion": region, "insertedContent": {"text": edit.text}}
            file = _artifact(edit.span.source.path)
            changes.append({"artifactLocation": file, "replacements": [replacement]})
        result["fixes"] = [{"artifactChanges": changes}]
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
    names = ("startLine", "startColumn", "endLine", "endColumn")
    return dict(zip(names, span.corners, strict=True))


#: By the name of the format.
DOCUMENTS = {"github": github, "sarif": sarif, "junit": junit, "gitlab": gitlab}
