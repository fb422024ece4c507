"""Which fields of all folders are of which messages."""

from __future__ import annotations

from collections.abc import Iterator

from idlc.diagnostics.source import Source, Span
from idlc.editor.workspace import State
from idlc.editor.world import World
from idlc.model import derive, ir


def states(world: World) -> Iterator[State]:
    """Yield what is known of each folder that can be looked at."""
    found = (project.state(world.documents) for project in world.projects.all())
    return (state for state in found if state is not None)


def uses(world: World) -> Iterator[tuple[State, Span, ir.TypeName]]:
    """Yield where fields name a message in their types, and which."""
    for state in states(world):
        for model in state.models.values():
            for interface in model.own:
                for section in derive.sections(interface):
                    for field, target in section.holders:
                        if field.type_span is not None:
                            yield state, field.type_span, target


def users(name: ir.TypeName, known: State, world: World) -> Iterator[tuple[State, Span]]:
    """Yield where fields name the message that a folder knows by a name.

    Where another folder of the workspace has a message of its own by this name, that is meant.
    """
    source = text_of(name, known)
    file = known.path_of(source).resolve() if source else None
    others = [
        state
        for state in states(world)
        for path, (own, _) in state.interfaces.items()
        if own.name == name and path.resolve() != file
    ]
    for state, span, target in uses(world):
        if target == name and not any(state is one for one in others):
            yield state, span


def text_of(name: ir.TypeName, state: State) -> Source | None:
    """Return the text that defines an interface."""
    for model in state.models.values():
        interface = model.interfaces.get(name)
        if interface is not None and interface.source is not None:
            return interface.source
    return state.source(name)
