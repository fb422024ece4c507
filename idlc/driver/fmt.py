"""The pipeline of `idlc fmt`: lay each file out, and write it if that changed anything."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from idlc.diagnostics.report import Report
from idlc.disk.exclude import Exclusions
from idlc.disk.find import InterfaceFile, find
from idlc.disk.output.rewrite import replace
from idlc.disk.read import read_source
from idlc.driver.laid_out import laid_out
from idlc.driver.stages import stage
from idlc.model import ir

if TYPE_CHECKING:
    from idlc.diagnostics.source import Source


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
