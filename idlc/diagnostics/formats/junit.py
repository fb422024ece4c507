"""A report as JUnit XML, as `colcon test-result` and CI servers read it."""

from __future__ import annotations

import re
from collections.abc import Iterable
from xml.sax.saxutils import escape, quoteattr

from idlc.diagnostics.codes import CODES
from idlc.diagnostics.formats import Run
from idlc.diagnostics.report import Diagnostic, Severity
from idlc.diagnostics.visible import one_line

_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit(diagnostics: Iterable[Diagnostic], run: Run) -> str:
    """Return the XML document: a test for each problem, and a passed one for each clean file.

    A warning is a passed test with output, unless it fails the run as well: servers fail a build
    for what the exit status does not.
    """
    found = list(diagnostics)
    failed = sum(run.strict or one.severity is Severity.ERROR for one in found)
    clean = [file for file in run.files if file not in {one.where[0] for one in found}]
    head = (
        f'<testsuite name="idlc" tests="{len(found) + len(clean)}" '
        f'failures="{failed}" errors="0" skipped="0">'
    )
    cases = [_case(one, failed=run.strict or one.severity is Severity.ERROR) for one in found]
    cases += [f'  <testcase classname="idlc" name={_quoted(file)}/>' for file in clean]
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', head, *cases, "</testsuite>", ""]
    # whatever encoding it is written in, it is read alike
    return "\n".join(lines).encode("ascii", "xmlcharrefreplace").decode("ascii")


def _case(one: Diagnostic, *, failed: bool) -> str:
    path, line = one.where[0], ""
    if one.span:
        line = ":{}:{}".format(*one.span.source.position(one.span.start))
    slug = CODES[one.code].slug if one.code in CODES else ""
    lines = (
        f"{path}{line}: {one.message}",
        *filter(None, (one.breaks, one.holds_for, one.hint and f"hint: {one.hint}")),
    )
    text = "\n".join(map(one_line, lines))
    name = f"{one.code} {slug}{line}"
    kind = one.severity.name.lower()
    tag = f"failure type={_quoted(kind)} message={_quoted(one.message)}" if failed else "system-out"
    text = text if failed else f"{kind}: {text}"
    return (
        f"  <testcase classname={_quoted(path or 'idlc')} name={_quoted(name)}>\n"
        f"    <{tag}>{escape(_legal(text))}</{tag.split()[0]}>\n"
        "  </testcase>"
    )


def _quoted(text: str) -> str:
    return quoteattr(_legal(one_line(text)))


def _legal(text: str) -> str:
    return _NOT_XML.sub("\N{REPLACEMENT CHARACTER}", text)
