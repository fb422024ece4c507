"""Formatting as `idlc fmt` does it: of a document, of a range, and while the user types."""

from __future__ import annotations

from idlc.check.format import laid_out
from idlc.diagnostics.report import Report
from idlc.editor.elements import differences
from idlc.editor.protocol.parts import DocumentParams, PositionParams, RangeParams, TextEdit
from idlc.editor.state import ServerState


def document(state: ServerState, params: DocumentParams) -> list[TextEdit]:
    """Return the edits that format a document; none where it has syntax errors."""
    context = state.context(params.text_document.uri)
    if context is None:
        return []
    new = laid_out(context.source, context.interface.name, Report())
    return [] if new is None else differences(context.source.text, new, state.encoding)


def part(state: ServerState, params: RangeParams) -> list[TextEdit]:
    """Return those edits that touch the lines of a range."""
    first, last = params.range.start.line, params.range.end.line
    if params.range.end.character == 0 and last > first:
        last -= 1
    return [
        edit
        for edit in document(state, DocumentParams(params.text_document))
        if edit.range.start.line <= last and max(edit.range.end.line - 1, first) >= first
    ]


def typed(state: ServerState, params: PositionParams) -> list[TextEdit]:
    """Return those edits that touch the line before the one that was begun."""
    before = params.position.line - 1
    return [
        edit
        for edit in document(state, DocumentParams(params.text_document))
        if edit.range.start.line == before == edit.range.end.line - 1
    ]
