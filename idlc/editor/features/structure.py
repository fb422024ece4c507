"""The parts of a file: symbols, folding ranges, selection ranges and links."""

from __future__ import annotations

from collections.abc import Iterator

from idlc.diagnostics.source import Span
from idlc.editor.documents import is_built_in
from idlc.editor.elements import Element, elements, section_names, snapshots, text_of
from idlc.editor.protocol.parts import (
    DocumentParams,
    Location,
    Part,
    PositionsParams,
    Range,
    WorkspaceSymbolParams,
)
from idlc.editor.state import CONTENT, InterfaceContext, ServerState
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


class InterfaceSymbol(Part, frozen=True):
    """An interface of any folder."""

    name: str
    kind: int
    location: Location
    container_name: str


def document(state: ServerState, params: DocumentParams) -> list[Symbol]:
    """Return the definitions of a file, by section where it has several."""
    context = state.context(params.text_document.uri)
    if context is None:
        return []
    definitions = list(elements(context.source, context.interface))
    names = section_names(context.interface)
    if not names:
        return [_symbol(element, state) for element in definitions]
    return [
        Symbol(
            name,
            "",
            _NAMESPACE,
            state.range(span),
            state.range(Span(span.source, span.start, span.start)),
            tuple(
                _symbol(element, state)
                for element in definitions
                if span.start <= element.line.start < span.end
            ),
        )
        for name, span in zip(names, sections(context), strict=False)
    ]


def sections(context: InterfaceContext) -> list[Span]:
    """Return the spans of the sections of a file, without the lines between them."""
    file = parse(context.source)
    starts = [section.start for section in file.sections]
    ends = [*file.separators, len(context.source.text)]
    return [Span(context.source, *place) for place in zip(starts, ends, strict=True)]


def _symbol(element: Element, state: ServerState) -> Symbol:
    kind = _CONSTANT if isinstance(element.meaning, ir.Constant) else _FIELD
    type_ = element.body.type.whole.text
    if element.meaning is not None:
        type_ = spell(element.meaning.type)
    name = element.body.name.text or "?"
    return Symbol(name, type_, kind, state.range(element.whole), state.range(element.name))


def workspace(state: ServerState, params: WorkspaceSymbolParams) -> list[InterfaceSymbol]:
    """Return the interfaces in whose full names the letters of a word occur in this order."""
    symbols: dict[InterfaceSymbol, None] = {}
    for snapshot in snapshots(state):
        for interface, source in snapshot.interfaces.values():
            if _fits(params.query.lower(), str(interface.name).lower()):
                where = state.location(Span(source, 0, 0), snapshot)
                kind = _KINDS[interface.name.kind]
                symbols[
                    InterfaceSymbol(interface.name.name, kind, where, interface.name.package)
                ] = None
    return list(symbols)[:MOST]


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


def folds(state: ServerState, params: DocumentParams) -> list[Fold]:
    """Return the sections of a service or action, and comments of several lines."""
    context = state.context(params.text_document.uri)
    if context is None:
        return []
    regions = [Fold(first, last, "comment") for first, last in _comments(context, state)]
    parts = sections(context)
    for span in parts if len(parts) > 1 else ():
        place = state.range(Span(span.source, span.start, span.start + len(span.text.rstrip())))
        if place.end.line > place.start.line:
            regions.append(Fold(place.start.line, place.end.line, "region"))
    return regions


def _comments(context: InterfaceContext, state: ServerState) -> Iterator[tuple[int, int]]:
    """Yield the first and last line of each run of comment lines."""
    lines = []
    for section in parse(context.source).sections:
        for line in section.lines:
            if line.comment and not line.code.strip():
                start = state.range(Span(context.source, line.start, line.start)).start
                lines.append(start.line)
    while lines:
        first = last = lines.pop(0)
        while lines and lines[0] == last + 1:
            last = lines.pop(0)
        if last > first:
            yield first, last


def selections(state: ServerState, params: PositionsParams) -> list[Selection]:
    """Return for each position the ranges around it: a part, its line, its section, the file."""
    context = state.context(params.text_document.uri)
    if context is None:
        return [Selection(Range(position, position)) for position in params.positions]
    whole = Span(context.source, 0, len(context.source.text))
    spans = [whole, *sections(context)]
    for element in elements(context.source, context.interface):
        line = Span(context.source, element.line.start, max(element.comment.end, element.whole.end))
        parts = [
            line,
            element.whole,
            element.span(element.body.type.whole),
            element.type,
            element.name,
        ]
        spans += [*parts, *([element.value] if element.value else []), element.comment]
    answers = []
    for position in params.positions:
        offset = state.offset(context.source, position)
        enclosing = sorted(
            {(s.start, s.end) for s in spans if s.start <= offset <= s.end and s.end > s.start},
            key=lambda place: place[0] - place[1],
        )
        selected: Selection | None = None
        last = (0, len(context.source.text))
        for start, end in enclosing:
            if last[0] <= start and end <= last[1]:
                selected = Selection(state.range(Span(context.source, start, end)), selected)
                last = start, end
        answers.append(selected or Selection(Range(position, position)))
    return answers


def links(state: ServerState, params: DocumentParams) -> list[Link]:
    """Return the types of a file that lead to other files."""
    context = state.context(params.text_document.uri)
    shows_texts = state.supports("workspace", CONTENT)
    resolved = []
    for element in elements(context.source, context.interface) if context else ():
        source = text_of(element.target, context.snapshot) if element.target and context else None
        # a file of the cache is only written when the user opens it
        if source is not None and context and (shows_texts or not is_built_in(source)):
            uri = state.location(Span(source, 0, 0), context.snapshot).uri
            resolved.append(Link(state.range(element.type), uri, f"open {element.target}"))
    return resolved
