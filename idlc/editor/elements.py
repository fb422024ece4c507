"""The elements of an interface file, and the one at a position."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from difflib import SequenceMatcher
from typing import Literal, NamedTuple, TypeAlias

from idlc.diagnostics.report import Edit
from idlc.diagnostics.source import Source, Span
from idlc.editor.protocol.parts import Position, TextEdit
from idlc.editor.protocol.positions import Places, lines_of
from idlc.editor.state import Known, ServerState
from idlc.editor.workspace import Snapshot
from idlc.language import tree
from idlc.language.parse import parse, parse_definition
from idlc.model import derive, ir
from idlc.model.lower import SECTIONS


def differences(old: str, new: str, encoding: str) -> list[TextEdit]:
    """Return the edits that turn one text into another: lines, each edit as few as can be."""
    before, after = lines_of(old), lines_of(new)
    places = Places(old, encoding)
    starts = [0]
    for line in before:
        starts.append(starts[-1] + len(line))
    return [
        TextEdit(places.range(starts[low], starts[high]), "".join(after[start:end]))
        for what, low, high, start, end in SequenceMatcher(
            None, before, after, autojunk=False
        ).get_opcodes()
        if what != "equal"
    ]


def workspace_edit(
    edits: Iterable[Edit], snapshot: Snapshot, state: ServerState
) -> dict[str, object]:
    """Return edits of any files as one, for the versions that are open."""
    found: dict[str, list[TextEdit]] = {}
    for one in dict.fromkeys(edits):
        uri = state.uri(snapshot.path_of(one.span.source))
        found.setdefault(uri, []).append(TextEdit(state.range(one.span), one.text))
    return of_documents(found, state)


def of_documents(edits: Mapping[str, list[TextEdit]], state: ServerState) -> dict[str, object]:
    """Return edits by URI as one, in the form that the client understands."""
    if not state.supports("workspace", "workspaceEdit", "documentChanges"):
        return {"changes": edits}
    return {"documentChanges": [document_edit(uri, some, state) for uri, some in edits.items()]}


def document_edit(uri: str, edits: Iterable[object], state: ServerState) -> dict[str, object]:
    """Return the edits of one document."""
    opened = state.documents.get(uri)
    version = opened.version if opened else None
    return {"textDocument": {"uri": uri, "version": version}, "edits": list(edits)}


Part: TypeAlias = Literal["type", "name", "value", "comment"]


class Element(NamedTuple):
    """A definition: its line, what the line says, and what that means, if anything.

    `message` is the structure whose section it stands in.
    """

    source: Source
    line: tree.Line
    body: tree.Field | tree.Constant
    message: ir.Message
    meaning: ir.Field | ir.Constant | None

    def span(self, piece: tree.Piece) -> Span:
        """Return the place of a piece of the line."""
        start = self.line.start + piece.start
        return Span(self.source, start, start + len(piece.text))

    @property
    def whole(self) -> Span:
        """The definition without its comment."""
        start = self.line.start
        return Span(self.source, start, start + len(self.line.definition))

    @property
    def name(self) -> Span:
        """Its name."""
        return self.span(self.body.name)

    @property
    def type(self) -> Span:
        """The name in its type, without bounds."""
        return self.span(self.body.type.name)

    @property
    def value(self) -> Span | None:
        """Its value or default."""
        piece = self.body.value if isinstance(self.body, tree.Constant) else self.body.default
        return self.span(piece) if piece else None

    @property
    def comment(self) -> Span:
        """The comment after it; may be empty."""
        start = self.line.start + len(self.line.code)
        return Span(self.source, start, start + len(self.line.comment))

    @property
    def target(self) -> ir.TypeName | None:
        """The message that its type names."""
        if not isinstance(self.meaning, ir.Field):
            return None
        element = ir.element_of(self.meaning.type)
        return element.target if isinstance(element, ir.Ref) else None


class Spot(NamedTuple):
    """A part of a definition."""

    element: Element
    part: Part
    span: Span


def elements(source: Source, interface: ir.Interface) -> Iterator[Element]:
    """Yield the definitions of a file in order; what is none is left out."""
    file = parse(source)
    parts = derive.sections(interface)
    meanings: dict[int, ir.Field | ir.Constant] = {}
    for part in parts:
        meanings |= {one.name_span.start: one for one in part.fields if one.name_span}
        meanings |= {one.name_span.start: one for one in part.constants if one.name_span}
    for section, message in zip(file.sections, parts, strict=False):
        for line in section.lines:
            code = line.after_optional or line
            if not code.definition:
                continue
            body = parse_definition(code.definition)
            if not isinstance(body, tree.Broken):
                meaning = meanings.get(code.start + body.name.start)
                yield Element(source, code, body, message, meaning)


def spot(state: ServerState, known: Known, position: Position) -> Spot | None:
    """Return what stands at a position; `None` outside of definitions.

    A name counts up to the place after its last character.
    """
    offset = state.offset(known.source, position)
    for one in elements(known.source, known.interface):
        end = one.line.start + len(one.line.code) + len(one.line.comment)
        if not one.line.start <= offset <= end:
            continue
        parts: list[tuple[Part, Span | None]] = [
            ("name", one.name),
            ("type", one.span(one.body.type.whole)),
            ("value", one.value),
            ("comment", one.comment),
        ]
        for part, span in parts:
            if span is not None and span.start <= offset <= span.end and span.end > span.start:
                return Spot(one, part, span)
        return None
    return None


def section_names(interface: ir.Interface) -> tuple[str, ...]:
    """Return what the sections of a file are called, such as `Request`; empty for a message."""
    names = SECTIONS[interface.name.kind]
    return tuple(name.lstrip("_") for name in names) if len(names) > 1 else ()


def snapshots(state: ServerState) -> Iterator[Snapshot]:
    """Yield what is known of each folder that can be looked at."""
    found = (workspace.snapshot() for workspace in state.workspaces())
    return (snapshot for snapshot in found if snapshot is not None)


def uses(state: ServerState) -> Iterator[tuple[Snapshot, Span, ir.TypeName]]:
    """Yield where fields name a message in their types, and which."""
    for snapshot in snapshots(state):
        for model in snapshot.models.values():
            for interface in model.own:
                for section in derive.sections(interface):
                    for field, target in section.holders:
                        if field.type_span is not None:
                            yield snapshot, field.type_span, target


def users(
    name: ir.TypeName, known: Snapshot, state: ServerState
) -> Iterator[tuple[Snapshot, Span]]:
    """Yield where fields name the message that a folder knows by a name.

    Where another folder of the workspace has a message of its own by this name, that is meant.
    """
    source = text_of(name, known)
    file = known.path_of(source).resolve() if source else None
    others = [
        snapshot
        for snapshot in snapshots(state)
        for path, (own, _) in snapshot.interfaces.items()
        if own.name == name and path.resolve() != file
    ]
    for snapshot, span, target in uses(state):
        if target == name and not any(snapshot is one for one in others):
            yield snapshot, span


def text_of(name: ir.TypeName, snapshot: Snapshot) -> Source | None:
    """Return the text that defines an interface."""
    for model in snapshot.models.values():
        interface = model.interfaces.get(name)
        if interface is not None and interface.source is not None:
            return interface.source
    return snapshot.source(name)
