"""What a package.xml says, each statement with its place."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING
from xml.parsers import expat

from idlc.checks.package.facts import Statement
from idlc.diagnostics.source import Source, Span
from idlc.disk.read import read_source

if TYPE_CHECKING:
    from idlc.diagnostics.report import Report

#: The elements whose children are statements.
_PARENTS = (["package"], ["package", "export"])


def statements(path: Path, name: str, report: Report) -> tuple[Statement, ...]:
    """Return what a package.xml says, in order; empty for a file that cannot be read as XML."""
    source = read_source(path, name, report)
    return () if source is None else read_statements(source)


def read_statements(source: Source) -> tuple[Statement, ...]:
    """Return what the text of a package.xml says, in order; empty if it is no XML."""
    data = source.text.encode("utf-8")
    parser = expat.ParserCreate("utf-8")
    parser.buffer_text = True
    above: list[str] = []
    texts: list[str] = []
    begun: list[tuple[int, dict[str, str]]] = []
    found: list[tuple[int, str, str, dict[str, str]]] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        if above in _PARENTS:
            texts.clear()  # a description may hold elements
        above.append(tag)
        begun.append((parser.CurrentByteIndex, attributes))

    def end(tag: str) -> None:
        del above[-1]
        at, attributes = begun.pop()
        if above in _PARENTS:
            found.append((at, tag, "".join(texts).strip(), attributes))

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = texts.append
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, ValueError):
        return ()
    return tuple(_placed(found, source, data))


def _placed(
    found: Iterable[tuple[int, str, str, dict[str, str]]], source: Source, data: bytes
) -> Iterator[Statement]:
    """Yield elements with their places, which expat counts in bytes."""
    at = characters = 0
    for begun, tag, text, attributes in sorted(found, key=lambda one: one[0]):
        characters += len(data[at:begun].decode("utf-8"))
        at = begun
        span = Span(source, characters, characters + len(tag) + 2)
        yield Statement(tag, text, span, attributes)
