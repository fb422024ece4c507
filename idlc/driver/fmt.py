"""The pipeline of `idlc fmt`: lay each file out, and write it if that changed anything."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from idlc.diagnostics.report import Report, Severity
from idlc.disk.exclude import Exclusions
from idlc.disk.find import InterfaceFile, find
from idlc.disk.output.rewrite import replace
from idlc.disk.read import read_source
from idlc.driver.stages import stage
from idlc.model import ir

if TYPE_CHECKING:
    from idlc.diagnostics.source import Source


#: How the codes begin of syntax errors, and of files that are too large.
_UNREADABLE = ("IDL1", "IDL6")


class Formatted(NamedTuple):
    """A file before and after; both are `None` if its syntax errors forbid a layout."""

    path: str
    old: str | None = None
    new: str | None = None

    @property
    def changed(self) -> bool:
        """Whether its layout is not the canonical one."""
        return self.old != self.new


def fmt(
    paths: Sequence[str], exclude: Exclusions, report: Report, *, write: bool
) -> Iterator[Formatted]:
    """Yield each file that paths mean, laid out; with `write`, after writing it.

    Files with syntax errors are reported and left alone.
    """
    for file in find(paths, report, exclude):
        source = read_source(file.path, file.shown, report)
        if source is None:
            continue
        with stage("format", file.shown):
            found = _format(file, source, report)
        if write and found.changed and found.new is not None:
            replace(file.path, file.shown, source.text, found.new, report)
        yield found


def _format(file: InterfaceFile, source: Source, report: Report) -> Formatted:
    new = laid_out(source, ir.TypeName("package", file.kind, file.name), report)
    return Formatted(file.shown) if new is None else Formatted(file.shown, source.text, new)


def laid_out(source: Source, name: ir.TypeName, report: Report) -> str | None:
    """Return a text laid out; report and return `None` if it cannot be parsed."""
    from idlc.diagnostics.source import Source
    from idlc.model.distro import NEWEST
    from idlc.model.lowering.file import lower
    from idlc.model.meaning import meaning
    from idlc.syntax.format import format_file
    from idlc.syntax.parse import parse

    problems, again = Report(), Report()
    tree = parse(source)
    before = lower(tree, name, problems, NEWEST)
    errors = [one for one in problems if one.severity is Severity.ERROR]
    unreadable = [one for one in errors if one.code.startswith(_UNREADABLE)]
    if unreadable:
        report.extend(unreadable)
        return None
    new = format_file(tree)
    if new == source.text:
        return new
    after = lower(parse(Source(source.path, new)), name, again, NEWEST)
    same = [one.code for one in errors] == [
        one.code for one in again if one.severity is Severity.ERROR
    ]
    if same and meaning(after) == meaning(before):
        return new
    if errors:  # what a wrong definition means cannot be compared for sure
        return source.text
    raise AssertionError("the layout would change the meaning; the file was left alone")
