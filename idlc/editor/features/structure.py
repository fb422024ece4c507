"""The parts of a file: what can be folded, what is selected next, and what leads elsewhere."""

from __future__ import annotations

from collections.abc import Iterator

from idlc.diagnostics.source import Span
from idlc.editor.documents import is_built_in
from idlc.editor.elements import Element, elements, section_names, snapshots, text_of
from idlc.editor.protocol.parts import AskedSymbols, AtPositions, Location, OfDocument, Part, Range
from idlc.editor.state import CONTENT, Known, ServerState
from idlc.language.parse import parse
from idlc.model import ir
from idlc.model.ir import spell

_NAMESPACE, _FIELD, _INTERFACE, _CONSTANT, _STRUCT = 3, 8, 11, 14, 23
_KINDS = {"msg": _STRUCT, "srv": _INTERFACE, "action": _INTERFACE}
#: Interfaces that are found by one search.
MOST = 1000


class Symbol(Part, frozen=True):
    """A part of a document, with the parts in it."""

    name: str
    detail: str
    kind: int
    range: Range
    selection_range: Range
    children: tuple[Symbol, ...] = ()


class Found(Part, frozen=True):
    """An interface of any folder."""

    name: str
    kind: int
    location: Location
    container_name: str


def document(state: ServerState, asked: OfDocument) -> list[Symbol]:
    """Return the definitions of a file, by section where it has several."""
    known = state.known(asked.text_document.uri)
    if known is None:
        return []
    found = list(elements(known.source, known.interface))
    names = section_names(known.interface)
    if not names:
        return [_symbol(one, state) for one in found]
    return [
        Symbol(
            name,
            "",
            _NAMESPACE,
            state.range(span),
            state.range(Span(span.source, span.start, span.start)),
            tuple(_symbol(one, state) for one in found if span.start <= one.line.start < span.end),
        )
        for name, span in zip(names, sections(known), strict=False)
    ]


def sections(known: Known) -> list[Span]:
    """Return the places of the sections of a file, without the lines between them."""
    file = parse(known.source)
    starts = [section.start for section in file.sections]
    ends = [*file.separators, len(known.source.text)]
    return [Span(known.source, *place) for place in zip(starts, ends, strict=True)]


def _symbol(one: Element, state: ServerState) -> Symbol:
    kind = _CONSTANT if isinstance(one.meaning, ir.Constant) else _FIELD
    type_ = one.body.type.whole.text
    if one.meaning is not None:
        type_ = spell(one.meaning.type)
    name = one.body.name.text or "?"
    return Symbol(name, type_, kind, state.range(one.whole), state.range(one.name))


def workspace(state: ServerState, asked: AskedSymbols) -> list[Found]:
    """Return the interfaces in whose full names the letters of a word occur in this order."""
    found: dict[Found, None] = {}
    for snapshot in snapshots(state):
        for interface, source in snapshot.interfaces.values():
            if _fits(asked.query.lower(), str(interface.name).lower()):
                where = state.location(Span(source, 0, 0), snapshot)
                kind = _KINDS[interface.name.kind]
                found[Found(interface.name.name, kind, where, interface.name.package)] = None
    return list(found)[:MOST]


def _fits(word: str, name: str) -> bool:
    letters = iter(name)
    return all(letter in letters for letter in word)


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


def folds(state: ServerState, asked: OfDocument) -> list[Fold]:
    """Return the sections of a service or action, and comments of several lines."""
    known = state.known(asked.text_document.uri)
    if known is None:
        return []
    found = [Fold(first, last, "comment") for first, last in _comments(known, state)]
    parts = sections(known)
    for span in parts if len(parts) > 1 else ():
        place = state.range(Span(span.source, span.start, span.start + len(span.text.rstrip())))
        if place.end.line > place.start.line:
            found.append(Fold(place.start.line, place.end.line, "region"))
    return found


def _comments(known: Known, state: ServerState) -> Iterator[tuple[int, int]]:
    """Yield the first and last line of each run of comment lines."""
    lines = []
    for section in parse(known.source).sections:
        for line in section.lines:
            if line.comment and not line.code.strip():
                start = state.range(Span(known.source, line.start, line.start)).start
                lines.append(start.line)
    while lines:
        first = last = lines.pop(0)
        while lines and lines[0] == last + 1:
            last = lines.pop(0)
        if last > first:
            yield first, last


def selections(state: ServerState, asked: AtPositions) -> list[Selection]:
    """Return for each position what is around it: a part, its line, its section, the file."""
    known = state.known(asked.text_document.uri)
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
        offset = state.offset(known.source, position)
        around = sorted(
            {(s.start, s.end) for s in spans if s.start <= offset <= s.end and s.end > s.start},
            key=lambda place: place[0] - place[1],
        )
        selected: Selection | None = None
        last = (0, len(known.source.text))
        for start, end in around:
            if last[0] <= start and end <= last[1]:
                selected = Selection(state.range(Span(known.source, start, end)), selected)
                last = start, end
        found.append(selected or Selection(Range(position, position)))
    return found


def links(state: ServerState, asked: OfDocument) -> list[Link]:
    """Return the types of a file that lead to other files."""
    known = state.known(asked.text_document.uri)
    shows_texts = state.supports("workspace", CONTENT)
    found = []
    for one in elements(known.source, known.interface) if known else ():
        source = text_of(one.target, known.snapshot) if one.target and known else None
        # a file of the cache is only made when somebody goes there
        if source is not None and known and (shows_texts or not is_built_in(source)):
            uri = state.location(Span(source, 0, 0), known.snapshot).uri
            found.append(Link(state.range(one.type), uri, f"open {one.target}"))
    return found
