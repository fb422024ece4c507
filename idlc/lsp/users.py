"""Which fields of all folders are of which messages."""

from __future__ import annotations

from collections.abc import Iterator

from idlc.diagnostics.source import Span
from idlc.driver.workspace import State
from idlc.lsp.world import World
from idlc.model import derive, ir


def uses(world: World) -> Iterator[tuple[State, Span, ir.TypeName]]:
    """Yield where fields name a message in their types, and which."""
    for project in world.projects.all():
        state = project.state(world.documents)
        for model in state.models.values() if state else ():
            for interface in model.own:
                for section in derive.sections(interface):
                    for field, target in section.holders:
                        if field.type_span is not None:
                            assert state is not None
                            yield state, field.type_span, target


def users(name: ir.TypeName, world: World) -> Iterator[tuple[State, Span]]:
    """Yield where fields name one message."""
    return ((state, span) for state, span, target in uses(world) if target == name)
