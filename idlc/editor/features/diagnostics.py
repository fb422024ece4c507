"""Problems for clients that request them: of a document, or of all that have any."""

from __future__ import annotations

from zlib import crc32

import msgspec

from idlc.editor.protocol.parts import DocumentParams, WorkspaceDiagnosticParams
from idlc.editor.publish import DocumentDiagnostic, diagnostics
from idlc.editor.state import ServerState


def document(state: ServerState, params: DocumentParams) -> dict[str, object]:
    """Return the problems of a document.

    All of them each time: Neovim forgets them with a document that it reads again, but not their
    result id.
    """
    return _report(diagnostics(state).get(params.text_document.uri, []), None)


def workspace(state: ServerState, params: WorkspaceDiagnosticParams) -> dict[str, object]:
    """Return the problems of every document that has any, or had some in the last answer."""
    by_uri = diagnostics(state)
    before = {previous.uri: previous.value for previous in params.previous_result_ids}
    items = []
    for uri in sorted({*by_uri, *before}):
        opened = state.documents.get(uri)
        report = _report(by_uri.get(uri, []), before.get(uri))
        items.append({"uri": uri, "version": opened.version if opened else None, **report})
    return {"items": items}


def _report(problems: list[DocumentDiagnostic], before: str | None) -> dict[str, object]:
    now = f"{crc32(msgspec.json.encode(problems)):08x}-{len(problems)}"
    if now == before:
        return {"kind": "unchanged", "resultId": now}
    return {"kind": "full", "resultId": now, "items": problems}
