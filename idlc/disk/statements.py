"""What a package.xml says, each statement with its place."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING
from xml.parsers import expat

from idlc.checks.facts import Statement
from idlc.disk.read import read_source
from idlc.text.source import Source, Span

if TYPE_CHECKING:
    from idlc.text.diagnostics import Report


def statements(path: Path, name: str, report: Report) -> tuple[Statement, ...]:
    """Return what a package.xml says, in order; empty for a file that cannot be read as XML."""
    source = read_source(path, name, report)
    return () if source is None else read_statements(source)


def read_statements(source: Source) -> tuple[Statement, ...]:
    """Return what the text of a package.xml says, in order; empty if it is no XML."""
    data = source.text.encode("utf-8")
    parser = expat.ParserCreate("utf-8")
    parser.buffer_text = True
    stack: list[str] = []
    texts: list[str] = []
    begun = 0
    found: list[Statement] = []

    def start(tag: str, _: dict[str, str]) -> None:
        nonlocal begun
        stack.append(tag)
        begun = parser.CurrentByteIndex
        texts.clear()

    def end(tag: str) -> None:
        if stack[:-1] in (["package"], ["package", "export"]):
            at = len(data[:begun].decode("utf-8"))
            length = len(tag) + 2
            found.append(Statement(tag, "".join(texts).strip(), Span(source, at, at + length)))
        stack.pop()

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = texts.append
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, ValueError):
        return ()
    return tuple(found)
