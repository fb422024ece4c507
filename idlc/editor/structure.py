"""The parts of a file: symbols, folding ranges, selection ranges, links, and the kinds of words."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby, pairwise
from typing import NamedTuple

from idlc.diagnostics.source import Span
from idlc.editor import parts
from idlc.editor.documents import is_built_in
from idlc.editor.elements import comments, elements, has_letters, section_names
from idlc.editor.protocol import MODIFIERS, TYPES
from idlc.editor.state import CONTENT, InterfaceContext, ServerState
from idlc.language import tree
from idlc.language.parse import parse
from idlc.model import ir
from idlc.model.ir import spell
from idlc.model.lowering.lower_types import STRINGS

_NAMESPACE, _FIELD, _INTERFACE, _CONSTANT, _STRUCT = 3, 8, 11, 14, 23
_KINDS = {"msg": _STRUCT, "srv": _INTERFACE, "action": _INTERFACE}
#: Interfaces that are found by one search.
MOST = 1000


def symbols(context: InterfaceContext, _: parts.DocumentParams) -> list[dict[str, object]]:
    """Return the definitions of a file, by section where it has several."""
    definitions = []
    for element in elements(context):
        meaning = element.meaning
        kind = _CONSTANT if isinstance(meaning, ir.Constant) else _FIELD
        type_ = spell(meaning.type) if meaning is not None else element.body.type.whole.text
        name = element.body.name.text or "?"
        symbol = _symbol(name, type_, kind, element.whole, element.name, context)
        definitions.append((element.line.start, symbol))
    names = section_names(context.interface)
    if not names:
        return [symbol for _, symbol in definitions]
    listed = []
    for name, span in zip(names, sections(context), strict=False):
        children = [symbol for start, symbol in definitions if span.start <= start < span.end]
        symbol = _symbol(name, "", _NAMESPACE, span, span.at(0, 0), context)
        listed.append(symbol | ({"children": children} if children else {}))
    return listed


def _symbol(
    name: str, detail: str, kind: int, whole: Span, selection: Span, context: InterfaceContext
) -> dict[str, object]:
    ranges = {"range": context.state.range(whole), "selectionRange": context.state.range(selection)}
    return {"name": name, "detail": detail, "kind": kind, **ranges}


def sections(context: InterfaceContext) -> list[Span]:
    """Return the spans of the sections of a file, without the lines between them."""
    file = parse(context.source)
    starts = [section.start for section in file.sections]
    ends = [*file.separators, len(context.source.text)]
    return [Span(context.source, *place) for place in zip(starts, ends, strict=True)]


def workspace(state: ServerState, params: parts.WorkspaceSymbolParams) -> list[dict[str, object]]:
    """Return the interfaces in whose full names the letters of a word occur in this order."""
    interfaces: dict[tuple[parts.Location, ir.TypeName], dict[str, object]] = {}
    for snapshot in state.snapshots():
        for interface, source in snapshot.interfaces.values():
            package, kind, name = interface.name
            if has_letters(str(interface.name), params.query):
                where = state.location(Span(source, 0, 0), snapshot.folder)
                about = {"name": name, "kind": _KINDS[kind], "containerName": package}
                interfaces[where, interface.name] = {**about, "location": where}
    return list(interfaces.values())[:MOST]


class SelectionRange(parts.ProtocolStruct, frozen=True):
    """A range, and the one around it."""

    range: parts.Range
    parent: SelectionRange | None = None


def folds(context: InterfaceContext, _: parts.DocumentParams) -> list[dict[str, object]]:
    """Return the sections of a service or action, and comments of several lines."""
    state = context.state
    alone = (span for line, span in comments(context) if not line.code.strip())
    lines = enumerate(state.range(span).start.line for span in alone)
    places = []
    for _, run in groupby(lines, lambda pair: pair[1] - pair[0]):
        numbers = [line for _, line in run]
        places.append((numbers[0], numbers[-1], "comment"))
    spans = sections(context)
    for span in spans if len(spans) > 1 else ():
        place = state.range(span.at(0, len(span.text.rstrip())))
        places.append((place.start.line, place.end.line, "region"))
    return [
        {"startLine": first, "endLine": last, "kind": kind}
        for first, last, kind in places
        if last > first
    ]


def selections(state: ServerState, params: parts.PositionsParams) -> list[SelectionRange]:
    """Return for each position the ranges around it: a part, its line, its section, the file."""
    context = state.context(params.text_document.uri)
    spans = [] if context is None else [Span(context.source, 0, len(context.source.text))]
    spans += sections(context) if context else ()
    for element in elements(context) if context else ():
        start, end = element.line.start, max(element.comment.end, element.whole.end)
        spans += [Span(element.source, start, end), element.whole]
        spans += [element.span(element.body.type.whole), element.type, element.name]
        spans += [*filter(None, (element.value, element.comment))]
    answers = []
    for position in params.positions:
        offset = state.offset(context.source, position) if context else 0
        around = {
            (span.start, span.end): span
            for span in spans
            if span.start < span.end and span.start <= offset <= span.end
        }
        selected = last = None
        for span in sorted(around.values(), key=lambda span: span.start - span.end):
            if last is None or (last.start <= span.start and span.end <= last.end):
                selected, last = SelectionRange(state.range(span), selected), span
        answers.append(selected or SelectionRange(parts.Range(position, position)))
    return answers


def links(context: InterfaceContext, _: parts.DocumentParams) -> list[dict[str, object]]:
    """Return the types of a file that lead to other files."""
    state = context.state
    shows_texts = state.supports("workspace", CONTENT)
    resolved: list[dict[str, object]] = []
    for element in elements(context):
        source = context.snapshot.source(element.target) if element.target else None
        # a file of the cache is only written when the user opens it
        if source is not None and (shows_texts or not is_built_in(source)):
            uri = state.location(Span(source, 0, 0), context.snapshot.folder).uri
            tip = f"open {element.target}"
            resolved.append({"range": state.range(element.type), "target": uri, "tooltip": tip})
    return resolved


class Token(NamedTuple):
    """A word with its kind."""

    span: Span
    kind: str
    modifiers: tuple[str, ...] = ()


def tokens(context: InterfaceContext, _: parts.DocumentParams) -> dict[str, list[int]]:
    """Return the tokens of a document: the kind of each word, by which editors colour it."""
    return _encoded(_tokens(context), context.state)


def tokens_in(context: InterfaceContext, params: parts.RangeParams) -> dict[str, list[int]]:
    """Return the tokens that touch a range."""
    state = context.state
    low, high = (state.offset(context.source, at) for at in (params.range.start, params.range.end))
    touching = (t for t in _tokens(context) if t.span.start <= high and low <= t.span.end)
    return _encoded(touching, state)


def _tokens(context: InterfaceContext) -> Iterator[Token]:
    for element in elements(context):
        if element.line.start and context.source.text[: element.line.start].endswith("@optional"):
            start = element.line.start - len("@optional")
            yield Token(Span(context.source, start, element.line.start), "keyword")
        type_ = element.body.type
        if type_.name.text in ir.PRIMITIVES or type_.name.text in STRINGS:
            yield Token(element.type, "type", ("defaultLibrary",))
        else:
            package, slash, _ = element.type.text.rpartition("/")
            if slash:
                yield Token(element.type.at(0, len(package)), "namespace")
            name = element.type.at(len(package) + len(slash), len(element.type.text))
            yield Token(name, "struct")
        for number in (type_.bound, type_.size):
            if number is not None:
                yield Token(element.span(number), "number")
        is_constant = isinstance(element.body, tree.Constant)
        modifiers = ("declaration", "readonly") if is_constant else ("declaration",)
        yield Token(element.name, "enumMember" if is_constant else "property", modifiers)
        if element.value is not None and element.value.text:
            is_text = type_.name.text in STRINGS and not type_.brackets
            yield Token(element.value, "string" if is_text else "number")
    yield from (Token(span, "comment") for _, span in comments(context))
    for before, after in pairwise(sections(context)):
        mark = Span(context.source, before.end, after.start)
        yield Token(mark.at(0, len(mark.text.rstrip())), "keyword")


def _encoded(tokens: Iterable[Token], state: ServerState) -> dict[str, list[int]]:
    """Return tokens as the protocol has them: five numbers each, positions from the last one."""
    data: list[int] = []
    last = parts.Position(0, 0)
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
    return {"data": data}
