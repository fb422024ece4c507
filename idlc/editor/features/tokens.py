"""Semantic tokens: the kind of each word of a file, by which editors colour it."""

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
from idlc.editor.protocol.parts import DocumentId, DocumentParams, Position, Range, RangeParams
from idlc.editor.state import InterfaceContext, ServerState
from idlc.language import tree
from idlc.model import ir
from idlc.model.lower_types import STRINGS


class Token(NamedTuple):
    """A word with its kind."""

    span: Span
    kind: str
    modifiers: tuple[str, ...] = ()


def document(state: ServerState, params: DocumentParams) -> dict[str, list[int]]:
    """Return the tokens of a document."""
    context = state.context(params.text_document.uri)
    return {"data": _encoded(_tokens(context), state) if context else []}


def part(state: ServerState, params: RangeParams) -> dict[str, list[int]]:
    """Return the tokens that touch a range."""
    context = state.context(params.text_document.uri)
    if context is None:
        return {"data": []}
    low = state.offset(context.source, params.range.start)
    high = state.offset(context.source, params.range.end)
    tokens = [
        token for token in _tokens(context) if token.span.start <= high and low <= token.span.end
    ]
    return {"data": _encoded(tokens, state)}


def _tokens(context: InterfaceContext) -> Iterator[Token]:
    for element in elements(context.source, context.interface):
        if element.line.start and context.source.text[: element.line.start].endswith("@optional"):
            start = element.line.start - len("@optional")
            yield Token(Span(context.source, start, element.line.start), "keyword")
        yield from _definition(element)
    yield from (Token(span, "comment") for span in comments(context))
    for before, after in zip(sections(context), sections(context)[1:], strict=False):
        mark = Span(context.source, before.end, after.start)
        yield Token(mark.at(0, len(mark.text.rstrip())), "keyword")


def _definition(element: Element) -> Iterator[Token]:
    type_ = element.body.type
    if type_.name.text in ir.PRIMITIVES or type_.name.text in STRINGS:
        yield Token(element.type, "type", ("defaultLibrary",))
    else:
        package, slash, _ = element.type.text.rpartition("/")
        if slash:
            yield Token(element.type.at(0, len(package)), "namespace")
        yield Token(element.type.at(len(package) + len(slash), len(element.type.text)), "struct")
    for number in (type_.bound, type_.size):
        if number is not None:
            yield Token(element.span(number), "number")
    is_constant = isinstance(element.body, tree.Constant)
    modifiers = ("declaration", "readonly") if is_constant else ("declaration",)
    yield Token(element.name, "enumMember" if is_constant else "property", modifiers)
    if element.value is not None and element.value.text:
        text = type_.name.text in STRINGS and not type_.brackets
        yield Token(element.value, "string" if text else "number")


def _encoded(tokens: Iterable[Token], state: ServerState) -> list[int]:
    """Return tokens as the protocol has them: five numbers each, positions from the last one."""
    data: list[int] = []
    last = Position(0, 0)
    for token in sorted(tokens, key=lambda entry: entry.span.start):
        range_ = state.range(token.span)
        start, end = range_.start, range_.end
        if end.line != start.line or end.character <= start.character:
            continue
        same = start.line == last.line
        across = start.character - (last.character if same else 0)
        modifiers = sum(1 << MODIFIERS.index(name) for name in token.modifiers)
        data += [start.line - last.line, across, end.character - start.character]
        data += [TYPES.index(token.kind), modifiers]
        last = start
    return data


_WHOLE = Range(Position(0, 0), Position(maxsize, 0))


def fingerprints(
    state: ServerState, documents: Iterable[Document]
) -> Iterator[tuple[Document, int]]:
    """Yield each document with a number for their hints, lenses and tokens."""
    counts = Counter(target for _, _, target in uses(state))
    for opened in documents:
        document_id = DocumentId(opened.uri)
        shown: list[object] = [
            hints(state, RangeParams(document_id, _WHOLE)),
            document(state, DocumentParams(document_id)),
            lenses(state, DocumentParams(document_id)),
        ]
        if context := state.context(opened.uri):
            model = context.snapshot.model_of(context.interface)
            name = context.interface.name
            has_hash = model and model.distro.has_hashes
            # the texts of the lenses, without searching all users for each document
            shown += [model.describer.hash(str(name)) if model and has_hash else "", counts[name]]
        yield opened, crc32(msgspec.json.encode(shown))
