"""The steps of a node's life: what it creates, what it starts, and how that is undone."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from idlc.scaffold.line_breaks import call
from idlc.scaffold.roles.role import ACTIVATE, Part, undo


class StatesView(NamedTuple):
    """What a lifecycle node does when its state changes."""

    on_configure: tuple[str, ...]
    on_activate: tuple[str, ...]


def plain(parts: Sequence[Part]) -> tuple[str, ...]:
    """Return the lines that set up a node without a lifecycle."""
    return (*_lines(parts, "remember"), *_lines(parts, "create"), *_lines(parts, "work"))


def remembered(parts: Sequence[Part], *, waits: bool) -> tuple[str, ...]:
    """Return the lines that set up what a lifecycle node remembers."""
    steps = ("self.undo_configure = ExitStack()", "self.undo_activate = ExitStack()")
    pauses = ("self.activation: object = None", "self.pauses: set[Future] = set()")
    return (*steps, *(pauses if waits else ()), *_lines(parts, "remember"))


def states(parts: Sequence[Part], tasks: Iterable[tuple[str, str]], *, waits: bool) -> StatesView:
    """Return what a lifecycle node does when it is configured, and when it starts to work.

    `tasks` are the methods that begin to ask others, each with the function that makes a request.
    A node that `waits` has coroutines, which must know how long it is active.
    """
    begun = ("self.activation = object()", *undo(ACTIVATE, "self.wake")) if waits else ()
    started = [
        line
        for method, request in tasks
        for line in call("self.spawn", [f"self.{method}", f"{request}(self.given)"], depth=2)
    ]
    work = (*begun, *_lines(parts, "work"), *started)
    return StatesView(on_configure=_lines(parts, "create"), on_activate=work)


def _lines(parts: Iterable[Part], which: str) -> tuple[str, ...]:
    return tuple(line for part in parts for line in getattr(part, which))
