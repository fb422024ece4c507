"""Circles in a graph, found without recursion, so that depth is no limit; messages have none."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator
from typing import TYPE_CHECKING, TypeVar

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic
from idlc.diagnostics.source import Span
from idlc.model import ir

if TYPE_CHECKING:
    from idlc.model.pool import Pool

Node = TypeVar("Node", bound=Hashable)
Edge = TypeVar("Edge")
#: Messages of a circle that are named.
NAMED = 10


def circles(
    roots: Iterable[Node],
    edges: Callable[[Node], Iterable[tuple[Edge, Node]]],
    done: set[Node],
) -> Iterator[tuple[list[Node], Edge]]:
    """Yield each circle as the nodes on it, with the edge that leads from the last to the first.

    Nodes in `done` are left out; every node that is reached becomes one of them.
    """
    for root in roots:
        path: list[Node] = []
        rest: list[Iterator[tuple[Edge, Node]]] = []
        places: dict[Node, int] = {}
        enter: Node | None = None if root in done else root
        while enter is not None or path:
            if enter is not None:
                places[enter] = len(path)
                path.append(enter)
                rest.append(iter(edges(enter)))
            edge, target = next(rest[-1], (None, None))
            enter = None
            if target is None or edge is None:
                done.add(path[-1])
                del rest[-1], places[path.pop()]
            elif target in places:
                yield path[places[target] :], edge
            elif target not in done:
                enter = target


def check_recursion(interfaces: Iterable[ir.TypeName], pool: Pool) -> None:
    """Note each field that closes a circle."""
    for path, field in circles(interfaces, pool.references, pool.searched):
        if field.type_span is not None:
            pool[path[-1]].errors.append(_circle(path, field.type_span))


def _circle(path: list[ir.TypeName], span: Span) -> Diagnostic:
    """Return the problem with a circle of the messages on `path`."""
    left_out = len(path) - NAMED
    shown = [name.name for name in path[:NAMED]]
    shown += [f"{left_out} more"] if left_out > 0 else []
    circle = " → ".join((*shown, path[0].name))
    return codes.RECURSIVE_TYPE.at(
        span,
        f"`{path[0].name}` contains itself: {circle}",
        hint="ROS 2 has no recursive types; refer to the other message by an id",
    )
