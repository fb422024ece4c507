"""Sections, fields and constants of a file, and the interfaces of all folders, by name."""

from __future__ import annotations

from idlc.diagnostics.source import Span
from idlc.lsp.elements import Element, elements, section_names
from idlc.lsp.protocol.parts import AskedSymbols, Location, OfDocument, Part, Range
from idlc.lsp.users import states
from idlc.lsp.world import Known, World
from idlc.model import ir
from idlc.model.spelling import spell
from idlc.syntax.parse import parse

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


def document(world: World, asked: OfDocument) -> list[Symbol]:
    """Return the definitions of a file, by section where it has several."""
    known = world.known(asked.text_document.uri)
    if known is None:
        return []
    found = list(elements(known.source, known.interface))
    names = section_names(known.interface)
    if not names:
        return [_symbol(one, world) for one in found]
    return [
        Symbol(
            name,
            "",
            _NAMESPACE,
            world.range(span),
            world.range(Span(span.source, span.start, span.start)),
            tuple(_symbol(one, world) for one in found if span.start <= one.line.start < span.end),
        )
        for name, span in zip(names, sections(known), strict=False)
    ]


def sections(known: Known) -> list[Span]:
    """Return the places of the sections of a file, without the lines between them."""
    file = parse(known.source)
    starts = [section.start for section in file.sections]
    ends = [*file.separators, len(known.source.text)]
    return [Span(known.source, *place) for place in zip(starts, ends, strict=True)]


def _symbol(one: Element, world: World) -> Symbol:
    kind = _CONSTANT if isinstance(one.meaning, ir.Constant) else _FIELD
    type_ = one.body.type.whole.text
    if one.meaning is not None:
        type_ = spell(one.meaning.type)
    name = one.body.name.text or "?"
    return Symbol(name, type_, kind, world.range(one.whole), world.range(one.name))


def workspace(world: World, asked: AskedSymbols) -> list[Found]:
    """Return the interfaces in whose full names the letters of a word occur in this order."""
    found: dict[Found, None] = {}
    for state in states(world):
        for interface, source in state.interfaces.values():
            if _fits(asked.query.lower(), str(interface.name).lower()):
                where = world.location(Span(source, 0, 0), state)
                kind = _KINDS[interface.name.kind]
                found[Found(interface.name.name, kind, where, interface.name.package)] = None
    return list(found)[:MOST]


def _fits(word: str, name: str) -> bool:
    letters = iter(name)
    return all(letter in letters for letter in word)
