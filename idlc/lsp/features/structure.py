"""The parts of a file: what can be folded, what is selected next, and what leads elsewhere."""

from __future__ import annotations

from collections.abc import Iterator

from idlc.diagnostics.source import Span
from idlc.lsp.elements import elements
from idlc.lsp.features.symbols import sections
from idlc.lsp.protocol.parts import AtPositions, OfDocument, Part, Range
from idlc.lsp.users import text_of
from idlc.lsp.world import CONTENT, Known, World, is_built_in
from idlc.syntax.parse import parse


class Fold(Part, frozen=True):
    """Lines that can be folded into the first."""

    start_line: int
    end_line: int
    kind: str


class Selection(Part, frozen=True):
    """A range, and the one around it."""

    range: Range
    parent: Selection | None = None


class Link(Part, frozen=True):
    """A range that leads to a document."""

    range: Range
    target: str
    tooltip: str


def folds(world: World, asked: OfDocument) -> list[Fold]:
    """Return the sections of a service or action, and comments of several lines."""
    known = world.known(asked.text_document.uri)
    if known is None:
        return []
    found = [Fold(first, last, "comment") for first, last in _comments(known, world)]
    parts = sections(known)
    for span in parts if len(parts) > 1 else ():
        place = world.range(Span(span.source, span.start, span.start + len(span.text.rstrip())))
        if place.end.line > place.start.line:
            found.append(Fold(place.start.line, place.end.line, "region"))
    return found


def _comments(known: Known, world: World) -> Iterator[tuple[int, int]]:
    """Yield the first and last line of each run of comment lines."""
    lines = []
    for section in parse(known.source).sections:
        for line in section.lines:
            if line.comment and not line.code.strip():
                start = world.range(Span(known.source, line.start, line.start)).start
                lines.append(start.line)
    while lines:
        first = last = lines.pop(0)
        while lines and lines[0] == last + 1:
            last = lines.pop(0)
        if last > first:
            yield first, last


def selections(world: World, asked: AtPositions) -> list[Selection]:
    """Return for each position what is around it: a part, its line, its section, the file."""
    known = world.known(asked.text_document.uri)
    if known is None:
        return [Selection(Range(one, one)) for one in asked.positions]
    whole = Span(known.source, 0, len(known.source.text))
    spans = [whole, *sections(known)]
    for one in elements(known.source, known.interface):
        line = Span(known.source, one.line.start, max(one.comment.end, one.whole.end))
        parts = [line, one.whole, one.span(one.body.type.whole), one.type, one.name]
        spans += [*parts, *([one.value] if one.value else []), one.comment]
    found = []
    for position in asked.positions:
        offset = world.offset(known.source, position)
        around = sorted(
            {(s.start, s.end) for s in spans if s.start <= offset <= s.end and s.end > s.start},
            key=lambda place: place[0] - place[1],
        )
        selected: Selection | None = None
        last = (0, len(known.source.text))
        for start, end in around:
            if last[0] <= start and end <= last[1]:
                selected = Selection(world.range(Span(known.source, start, end)), selected)
                last = start, end
        found.append(selected or Selection(Range(position, position)))
    return found


def links(world: World, asked: OfDocument) -> list[Link]:
    """Return the types of a file that lead to other files."""
    known = world.known(asked.text_document.uri)
    shows_texts = world.supports("workspace", CONTENT)
    found = []
    for one in elements(known.source, known.interface) if known else ():
        source = text_of(one.target, known.state) if one.target and known else None
        # a file of the cache is only made when somebody goes there
        if source is not None and known and (shows_texts or not is_built_in(source)):
            uri = world.location(Span(source, 0, 0), known.state).uri
            found.append(Link(world.range(one.type), uri, f"open {one.target}"))
    return found
