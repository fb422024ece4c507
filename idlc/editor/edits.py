"""Edits of texts, as editors make them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from difflib import SequenceMatcher

from idlc.diagnostics.report import Edit
from idlc.editor.protocol.parts import TextEdit
from idlc.editor.protocol.positions import Places, lines_of
from idlc.editor.state import ServerState
from idlc.editor.workspace import Snapshot


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
