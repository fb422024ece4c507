"""The elements of an interface file, the one at a position, uses of interfaces, and edits."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from difflib import SequenceMatcher
from itertools import accumulate
from pathlib import Path
from typing import Literal, NamedTuple, TypeAlias

from idlc.diagnostics.report import Edit
from idlc.diagnostics.source import Source, Span
from idlc.editor.documents import Places, lines_of
from idlc.editor.parts import Position, TextEdit
from idlc.editor.state import InterfaceContext, ServerState
from idlc.editor.workspace import Snapshot, in_folder
from idlc.language import tree
from idlc.language.definition import parse_definition
from idlc.language.parse import parse
from idlc.model import derive, ir
from idlc.model.lowering.lower import SECTIONS

_ANNOTATION = "idlc.rename"


def differences(old: str, new: str, encoding: str) -> list[TextEdit]:
    """Return the edits that turn one text into another: whole lines, as few as possible."""
    before, after = lines_of(old), lines_of(new)
    places = Places(old, encoding)
    starts = [*accumulate(map(len, before), initial=0)]
    matcher = SequenceMatcher(None, before, after, autojunk=False)
    return [
        TextEdit(places.range(starts[low], starts[high]), "".join(after[start:end]))
        for what, low, high, start, end in matcher.get_opcodes()
        if what != "equal"
    ]


def by_uri(edits: Iterable[Edit], folder: Path, state: ServerState) -> dict[str, list[TextEdit]]:
    """Return edits of files of a folder by the URI of their document."""
    edited: dict[str, list[TextEdit]] = {}
    for edit in dict.fromkeys(edits):
        uri = state.uri(in_folder(folder, edit.span.source.path))
        edited.setdefault(uri, []).append(TextEdit(state.range(edit.span), edit.text))
    return edited


def workspace_edit(
    edits: Mapping[str, list[TextEdit]],
    state: ServerState,
    move: Mapping[str, str] | None = None,
    note: Mapping[str, object] | None = None,
) -> dict[str, object]:
    """Return edits by URI as one workspace edit, in the form that the client understands.

    `move` has the old and the new URI of a file that is renamed then; `note` annotates all of it.
    """
    if not (move or note or state.supports("workspace", "workspaceEdit", "documentChanges")):
        return {"changes": edits}
    mark = {"annotationId": _ANNOTATION} if note else {}
    changes: list[object] = []
    for uri, some in edits.items():
        opened = state.documents.get(uri)
        document = {"uri": uri, "version": opened.version if opened else None}
        marked = [{"range": edit.range, "newText": edit.new_text, **mark} for edit in some]
        changes.append({"textDocument": document, "edits": marked})
    changes += [{"kind": "rename", **move, **mark}] if move else []
    notes = {"changeAnnotations": {_ANNOTATION: note}} if note else {}
    return {"documentChanges": changes, **notes}


DeclarationPart: TypeAlias = Literal["type", "name", "value", "comment"]


class Declaration(NamedTuple):
    """A definition: its line, the line's syntax tree, and the field or constant, if it is valid.

    `message` is the structure of its section.
    """

    source: Source
    line: tree.Line
    body: tree.Field | tree.Constant
    message: ir.Message
    meaning: ir.Field | ir.Constant | None

    def span(self, piece: tree.Piece) -> Span:
        """Return the span of a piece of the line."""
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

    element: Declaration
    part: DeclarationPart
    span: Span


def elements(context: InterfaceContext) -> Iterator[Declaration]:
    """Yield the definitions of a file in order; lines that are none are left out."""
    file = parse(context.source)
    parts = derive.sections(context.interface)
    meanings: dict[int, ir.Field | ir.Constant] = {}
    for part in parts:
        definitions: tuple[ir.Field | ir.Constant, ...] = (*part.fields, *part.constants)
        meanings |= {each.name_span.start: each for each in definitions if each.name_span}
    for section, message in zip(file.sections, parts, strict=False):
        for line in section.lines:
            code = line.after_optional or line
            if not code.definition:
                continue
            body = parse_definition(code.definition)
            if not isinstance(body, tree.Fault):
                meaning = meanings.get(code.start + body.name.start)
                yield Declaration(context.source, code, body, message, meaning)


def comments(context: InterfaceContext) -> Iterator[tuple[tree.Line, Span]]:
    """Yield every comment of a file, with its line."""
    for section in parse(context.source).sections:
        for line in section.lines:
            if line.comment:
                start = line.start + len(line.code)
                yield line, Span(context.source, start, start + len(line.comment))


def spot_at(context: InterfaceContext, position: Position) -> Spot | None:
    """Return the part of a definition at a position; `None` outside of definitions.

    A name includes the position after its last character.
    """
    offset = context.state.offset(context.source, position)
    for element in elements(context):
        if not element.line.start <= offset <= element.comment.end:
            continue
        parts: list[tuple[DeclarationPart, Span | None]] = [
            ("name", element.name),
            ("type", element.span(element.body.type.whole)),
            ("value", element.value),
            ("comment", element.comment),
        ]
        for part, span in parts:
            if span and span.start <= offset <= span.end and span.end > span.start:
                return Spot(element, part, span)
        return None
    return None


def has_letters(name: str, word: str) -> bool:
    """Return whether a name has the letters of a word in their order, whatever their case."""
    letters = iter(name.lower())
    return all(letter in letters for letter in word.lower())


def section_names(interface: ir.Interface) -> tuple[str, ...]:
    """Return the names of the sections of a file, such as `Request`; empty for a message."""
    names = SECTIONS[interface.name.kind]
    return tuple(name.lstrip("_") for name in names) if len(names) > 1 else ()


def uses(state: ServerState) -> Iterator[tuple[Snapshot, Span, ir.TypeName]]:
    """Yield each place where a field's type names a message, and the message."""
    for snapshot in state.snapshots():
        for interface, _ in snapshot.interfaces.values():
            for section in derive.sections(interface):
                for field, target in section.holders:
                    if field.type_span is not None:
                        yield snapshot, field.type_span, target


def users(name: ir.TypeName, home: Snapshot, state: ServerState) -> Iterator[tuple[Snapshot, Span]]:
    """Yield each place where a field's type names the message that a folder has by a name.

    Fields of another folder that has its own message of this name refer to that one.
    """
    source = home.source(name)
    file = home.path_of(source).resolve() if source else None
    overriding = [
        snapshot
        for snapshot in state.snapshots()
        for path, (own, _) in snapshot.interfaces.items()
        if own.name == name and path.resolve() != file
    ]
    for snapshot, span, target in uses(state):
        if target == name and not any(snapshot is other for other in overriding):
            yield snapshot, span
