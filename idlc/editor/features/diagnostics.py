"""Problems, for clients that ask: of a document, or of all that have any."""

from __future__ import annotations

from zlib import crc32

import msgspec

from idlc.editor.protocol.parts import AskedWorkspace, OfDocument
from idlc.editor.publish import Shown, diagnostics
from idlc.editor.state import ServerState


def document(state: ServerState, asked: OfDocument) -> dict[str, object]:
    """Return the problems of a document.

    All of them each time: Neovim forgets them with a document that it reads again, but not that
    they were told.
    """
    return _report(diagnostics(state).get(asked.text_document.uri, []), None)


def workspace(state: ServerState, asked: AskedWorkspace) -> dict[str, object]:
    """Return the problems of every document that has any, or had some when it was told."""
    found = diagnostics(state)
    before = {one.uri: one.value for one in asked.previous_result_ids}
    items = []
    for uri in sorted({*found, *before}):
        opened = state.documents.get(uri)
        report = _report(found.get(uri, []), before.get(uri))
        items.append({"uri": uri, "version": opened.version if opened else None, **report})
    return {"items": items}


def _report(found: list[Shown], before: str | None) -> dict[str, object]:
    now = f"{crc32(msgspec.json.encode(found)):08x}-{len(found)}"
    if now == before:
        return {"kind": "unchanged", "resultId": now}
    return {"kind": "full", "resultId": now, "items": found}
