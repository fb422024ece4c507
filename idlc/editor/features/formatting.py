"""Layout, as `idlc fmt` has it: of a document, of a range, and as one types."""

from __future__ import annotations

from idlc.check.format import laid_out
from idlc.diagnostics.report import Report
from idlc.editor.elements import differences
from idlc.editor.protocol.parts import AtPosition, OfDocument, OfRange, TextEdit
from idlc.editor.state import ServerState


def document(state: ServerState, asked: OfDocument) -> list[TextEdit]:
    """Return the edits that lay a document out; none where it has syntax errors."""
    known = state.known(asked.text_document.uri)
    if known is None:
        return []
    new = laid_out(known.source, known.interface.name, Report())
    return [] if new is None else differences(known.source.text, new, state.encoding)


def part(state: ServerState, asked: OfRange) -> list[TextEdit]:
    """Return those edits that touch the lines of a range."""
    first, last = asked.range.start.line, asked.range.end.line
    if asked.range.end.character == 0 and last > first:
        last -= 1
    return [
        edit
        for edit in document(state, OfDocument(asked.text_document))
        if edit.range.start.line <= last and max(edit.range.end.line - 1, first) >= first
    ]


def typed(state: ServerState, asked: AtPosition) -> list[TextEdit]:
    """Return those edits that touch the line before the one that was begun."""
    before = asked.position.line - 1
    return [
        edit
        for edit in document(state, OfDocument(asked.text_document))
        if edit.range.start.line == before == edit.range.end.line - 1
    ]
