"""Which fields of all folders are of which messages."""

from __future__ import annotations

from collections.abc import Iterator

from idlc.diagnostics.source import Source, Span
from idlc.editor.state import ServerState
from idlc.editor.workspace import Snapshot
from idlc.model import derive, ir


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
