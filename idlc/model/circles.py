"""Circles in a graph, found without recursion, so that depth is no limit."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator
from typing import TypeVar

Node = TypeVar("Node", bound=Hashable)
Edge = TypeVar("Edge")


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
