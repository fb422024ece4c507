"""Which kind of word each word of a file is, as an editor colours them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from sys import maxsize
from typing import NamedTuple
from zlib import crc32

import msgspec

from idlc.diagnostics.source import Span
from idlc.editor.documents import Document
from idlc.editor.elements import Element, elements, uses
from idlc.editor.features.lenses import hints, lenses
from idlc.editor.features.navigation import comments
from idlc.editor.features.structure import sections
from idlc.editor.protocol.capabilities import MODIFIERS, TYPES
from idlc.editor.protocol.parts import DocumentId, OfDocument, OfRange, Position, Range
from idlc.editor.state import Known, ServerState
from idlc.language import tree
from idlc.model import ir
from idlc.model.lower_types import STRINGS


class Token(NamedTuple):
    """A word with its kind."""

    span: Span
    kind: str
    modifiers: tuple[str, ...] = ()


def document(state: ServerState, asked: OfDocument) -> dict[str, list[int]]:
    """Return the tokens of a document."""
    known = state.known(asked.text_document.uri)
    return {"data": _encoded(_tokens(known), state) if known else []}


def part(state: ServerState, asked: OfRange) -> dict[str, list[int]]:
    """Return the tokens that touch a range."""
    known = state.known(asked.text_document.uri)
    if known is None:
        return {"data": []}
    low = state.offset(known.source, asked.range.start)
    high = state.offset(known.source, asked.range.end)
    found = [one for one in _tokens(known) if one.span.start <= high and low <= one.span.end]
    return {"data": _encoded(found, state)}


def _tokens(known: Known) -> Iterator[Token]:
    for one in elements(known.source, known.interface):
        if one.line.start and known.source.text[: one.line.start].endswith("@optional"):
            start = one.line.start - len("@optional")
            yield Token(Span(known.source, start, one.line.start), "keyword")
        yield from _definition(one)
    yield from (Token(span, "comment") for span in comments(known))
    for before, after in zip(sections(known), sections(known)[1:], strict=False):
        mark = Span(known.source, before.end, after.start)
        yield Token(mark.at(0, len(mark.text.rstrip())), "keyword")


def _definition(one: Element) -> Iterator[Token]:
    type_ = one.body.type
    if type_.name.text in ir.PRIMITIVES or type_.name.text in STRINGS:
        yield Token(one.type, "type", ("defaultLibrary",))
    else:
        package, slash, _ = one.type.text.rpartition("/")
        if slash:
            yield Token(one.type.at(0, len(package)), "namespace")
        yield Token(one.type.at(len(package) + len(slash), len(one.type.text)), "struct")
    for number in (type_.bound, type_.size):
        if number is not None:
            yield Token(one.span(number), "number")
    is_constant = isinstance(one.body, tree.Constant)
    modifiers = ("declaration", "readonly") if is_constant else ("declaration",)
    yield Token(one.name, "enumMember" if is_constant else "property", modifiers)
    if one.value is not None and one.value.text:
        text = type_.name.text in STRINGS and not type_.brackets
        yield Token(one.value, "string" if text else "number")


def _encoded(found: Iterable[Token], state: ServerState) -> list[int]:
    """Return tokens as the protocol has them: five numbers each, places from the one before."""
    data: list[int] = []
    last = Position(0, 0)
    for one in sorted(found, key=lambda token: token.span.start):
        place = state.range(one.span)
        start, end = place.start, place.end
        if end.line != start.line or end.character <= start.character:
            continue
        same = start.line == last.line
        across = start.character - (last.character if same else 0)
        modifiers = sum(1 << MODIFIERS.index(name) for name in one.modifiers)
        data += [start.line - last.line, across, end.character - start.character]
        data += [TYPES.index(one.kind), modifiers]
        last = start
    return data


_WHOLE = Range(Position(0, 0), Position(maxsize, 0))


def fingerprints(
    state: ServerState, documents: Iterable[Document]
) -> Iterator[tuple[Document, int]]:
    """Yield each document with a number for their hints, lenses and tokens."""
    counts = Counter(target for _, _, target in uses(state))
    for one in documents:
        asked = DocumentId(one.uri)
        shown: list[object] = [
            hints(state, OfRange(asked, _WHOLE)),
            document(state, OfDocument(asked)),
            lenses(state, OfDocument(asked)),
        ]
        if known := state.known(one.uri):
            model = known.snapshot.model_of(known.interface)
            name = known.interface.name
            has_hash = model and model.distro.has_hashes
            # what the lenses say, without looking through all users for each document
            shown += [model.describer.hash(str(name)) if model and has_hash else "", counts[name]]
        yield one, crc32(msgspec.json.encode(shown))
