"""The steps of a node's life: what it creates, what it starts, and how that is undone."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from idlc.scaffold import spec
from idlc.scaffold.endpoints import ACTIVATE, Part, interval, undo
from idlc.scaffold.line_breaks import call

#: Roles whose methods wait for something.
PAUSING = {"client", "action_client", "action_server"}


class StatesView(NamedTuple):
    """What a lifecycle node does when its state changes."""

    on_configure: tuple[str, ...]
    on_activate: tuple[str, ...]


def states(
    node: spec.Node,
    parts: Sequence[Part],
    timers: Sequence[str],
    tasks: Iterable[tuple[str, str]],
) -> StatesView:
    """Return what a node does when it is created, or configured, and when it starts to work.

    `tasks` are the methods that clients begin with, each with the function that makes a request.
    """
    return StatesView(
        on_configure=_lines(parts, "create"),
        on_activate=(
            *_begun(node, parts),
            *_lines(parts, "work"),
            *_ticking(node, timers),
            *(_started(tasks) if node.lifecycle else ()),
        ),
    )


def pauses(parts: Iterable[Part]) -> bool:
    """Whether any of the endpoints waits for something."""
    return any(part.role in PAUSING for part in parts)


def kept(node: spec.Node, parts: Sequence[Part]) -> tuple[str, ...]:
    """Return the lines that set up what a node remembers."""
    lines = _lines(parts, "start")
    if not node.lifecycle:
        return lines
    steps = ("self.undo_configure = ExitStack()", "self.undo_activate = ExitStack()")
    waits = ("self.activation: object = None", "self.pauses: set[Future] = set()")
    return (*steps, *(waits if pauses(parts) else ()), *lines)


def _begun(node: spec.Node, parts: Sequence[Part]) -> tuple[str, ...]:
    """Return the lines by which coroutines know how long the node is active."""
    if not (node.lifecycle and pauses(parts)):
        return ()
    return ("self.activation = object()", *undo(ACTIVATE, "self.wake"))


def _lines(parts: Iterable[Part], which: str) -> tuple[str, ...]:
    return tuple(line for part in parts for line in getattr(part, which))


def _ticking(node: spec.Node, timers: Sequence[str]) -> list[str]:
    """Return the lines that start the node's own timers."""
    found = []
    for name, seconds in zip(timers, node.timers, strict=True):
        timer = f"self.{name}_timer"
        found.append(f"{timer} = self.create_timer({interval(seconds)}, self.{name})")
        found += undo(ACTIVATE, "self.destroy_timer", timer) if node.lifecycle else ()
    return found


def _started(tasks: Iterable[tuple[str, str]]) -> list[str]:
    """Return the lines of an activation that start what clients do."""
    calls = [call("self.spawn", [f"self.{m}", f"{r}(self.given)"], depth=2) for m, r in tasks]
    return [line for one in calls for line in one]
