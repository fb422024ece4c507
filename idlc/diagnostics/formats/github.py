"""A report as GitHub's workflow commands, which become annotations of a pull request."""

from __future__ import annotations

from collections.abc import Iterable

from idlc.diagnostics.codes import CODES
from idlc.diagnostics.formats import Run
from idlc.diagnostics.report import Diagnostic
from idlc.diagnostics.visible import one_line


def github(diagnostics: Iterable[Diagnostic], _: Run) -> str:
    """Return one command for each problem."""
    return "".join(map(_command, diagnostics))


def _command(one: Diagnostic) -> str:
    slug = CODES[one.code].slug if one.code in CODES else ""
    facts = {"file": one.file, **_region(one), "title": f"{one.code} {slug}".strip()}
    listed = ",".join(
        f"{key}={_property(one_line(str(value)))}" for key, value in facts.items() if value
    )
    parts = (one.message, one.breaks, one.holds_for, one.hint, one.within)
    text = "\n".join(one_line(part) for part in parts if part)
    return f"::{one.severity.name.lower()} {listed}::{_escaped(text)}\n"


def notice(title: str, text: str) -> str:
    """Return a command that shows a line about the whole run."""
    return f"::notice title={_property(one_line(title))}::{_escaped(one_line(text))}\n"


def _region(one: Diagnostic) -> dict[str, int]:
    if one.span is None or one.within:
        return {}
    line, column = one.span.source.position(one.span.start)
    end_line, end_column = one.span.source.position(one.span.end)
    # GitHub shows columns only for places within one line
    if end_line != line:
        return {"line": line, "endLine": end_line}
    return {"line": line, "endLine": line, "col": column, "endColumn": end_column}


def _escaped(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _escaped(text).replace(":", "%3A").replace(",", "%2C")
