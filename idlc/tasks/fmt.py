"""The canonical layout of a file, which keeps its meaning."""

from __future__ import annotations

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.language.format import format_file
from idlc.language.parse import parse
from idlc.model import ir
from idlc.model.distros import NEWEST
from idlc.model.ir import meaning
from idlc.model.lowering.lower import lower

#: Prefixes of the codes of syntax errors, and of files that are too large.
_UNREADABLE = ("IDL1", "IDL6")


def laid_out(source: Source, name: ir.TypeName, report: Report) -> str | None:
    """Return a text laid out; report and return `None` if it cannot be parsed."""
    problems, again = Report(), Report()
    tree = parse(source)
    before = lower(tree, name, problems, NEWEST)
    unreadable = [problem for problem in problems.errors if problem.code.startswith(_UNREADABLE)]
    if unreadable:
        report.extend(unreadable)
        return None
    new = format_file(tree)
    if new == source.text:
        return new
    after = lower(parse(Source(source.path, new)), name, again, NEWEST)
    codes = [[problem.code for problem in each.errors] for each in (problems, again)]
    if codes[0] == codes[1] and meaning(after) == meaning(before):
        return new
    if problems.had_errors:  # the meaning of a wrong definition cannot be compared reliably
        return source.text
    raise AssertionError("formatting would change the meaning; the file was not changed")
