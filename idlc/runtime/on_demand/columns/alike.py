"""Messages of one layout: what is found in the first of them is in all at the same places.

The layout depends on sizes and counts alone. So one message is walked over, and its sizes
are looked for in all others, where it has them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from .gather import Source
from .lanes import Found, Lanes, joined
from .plan import Level, List
from .walk import Walk

#: From so many messages on it is worthwhile to look, if so large a part of them is alike.
MANY = 64
PART = 0.25


def alike(
    plan: Level, source: Source, order: str, lanes: Lanes, found: Found
) -> Iterator[Any]:
    """Yield which lanes were of one layout, and are done with; those of another afterwards."""
    rest = np.arange(len(lanes.at))
    while len(rest) >= MANY and any(map(_varied, plan.steps)):
        lane = lanes.some(rest)
        one = Found()
        walk = Walk(order, one)
        walk.enter(source, lane, 0)
        one.count[plan.key] = 1
        walk.level(plan, int(lane.at[0]), 0)
        same = _same(source, order, lane, walk.sizes)
        if same.sum() < PART * len(rest):
            return
        chosen = rest[same]
        _spread(plan, one, lanes.at[chosen], found)
        yield chosen
        rest = rest[~same]


def _varied(step: Any) -> bool:
    """Return whether a scan would have to go over it element by element."""
    return isinstance(step, List) and not (step.level.packed or step.level.fixed)


def _same(
    source: Source, order: str, lanes: Lanes, sizes: list[tuple[int, int]]
) -> Any:
    """Return which lanes are as long as the first, and have its sizes in the same places."""
    lengths = lanes.end - lanes.at
    same = lengths == lengths[0]
    starts = lanes.at if same.all() else lanes.at[same]
    equal: Any = True
    for at, size in sizes:
        equal &= source.items(starts + (at - int(starts[0])), f"{order}u4") == size
    same[same] = equal
    return same


def _spread(plan: Level, one: Found, starts: Any, found: Found) -> None:
    """Add what was found in the first of some messages as found in all of them."""
    many = len(starts)
    for kept, parts in one.at.items():
        places = joined(parts) - starts[0]
        found.at[kept].append((starts[:, None] + places).ravel())
    for kept, parts in one.size.items():
        found.size[kept].append(np.tile(joined(parts), many))
    for level, around in _levels(plan):
        if level.key in one.parent:
            first = found.count[around.key] + np.arange(many) * one.count[around.key]
            parents = first[:, None] + joined(one.parent[level.key])
            found.parent[level.key].append(parents.ravel())
            index = joined(one.index[level.key])
            found.index[level.key].append(np.tile(index, many))
    for kept, count in one.count.items():
        found.count[kept] += many * count


def _levels(level: Level) -> Iterator[tuple[Level, Level]]:
    """Yield all levels inside of one, each with the one around it."""
    for step in level.steps:
        if isinstance(step, List):
            yield step.level, level
            yield from _levels(step.level)
