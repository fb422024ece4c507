"""Who uses an interface, and what it uses, as a picture: users left, used types right.

All places are decided here; the template writes them as SVG.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from idlc.model import ir

_HEIGHT = 30
_GAP = 12
_CHARACTER = 7.3
_BETWEEN = 70
#: More neighbours than these make a picture that nobody reads.
_MOST = 14


class Box(NamedTuple):
    """An interface; `page` is where a click leads, empty for the page itself and what has none."""

    x: str
    y: str
    width: str
    height: str
    middle: str
    baseline: str
    text: str
    own: bool
    page: str


class Picture(NamedTuple):
    """A drawing; `lines` are curves as SVG describes them."""

    label: str
    width: str
    height: str
    lines: Sequence[str]
    boxes: Sequence[Box]


class _Node(NamedTuple):
    name: ir.TypeName | None
    text: str


class _Column(NamedTuple):
    """Nodes below each other, from `start` to `end`."""

    nodes: list[_Node]
    start: float
    width: float

    @property
    def end(self) -> float:
        return self.start + self.width


def picture(
    name: ir.TypeName,
    users: Iterable[ir.TypeName],
    used: Iterable[ir.TypeName],
    pages: Mapping[ir.TypeName, str],
) -> Picture | None:
    """Return the picture of an interface, `None` without neighbours."""
    left, right = _cut(sorted(users), name.package), _cut(sorted(used), name.package)
    if not left and not right:
        return None
    users_ = _column(left, 1.0)
    own = _column([_Node(name, name.name)], users_.end + (_BETWEEN if left else 0))
    used_ = _column(right, own.end + _BETWEEN)
    columns = (users_, own, used_)
    height = max(len(column.nodes) for column in columns) * (_HEIGHT + _GAP) + _GAP
    middle = height / 2
    lines = [_line((users_.end, y), (own.start, middle)) for y, _ in _places(users_, height)]
    lines += [_line((own.end, middle), (used_.start, y)) for y, _ in _places(used_, height)]
    others = {one: page for one, page in pages.items() if one != name}
    return Picture(
        f"what uses {name.name}, and what it uses",
        f"{(used_ if right else own).end + 1:.0f}",
        f"{height:.0f}",
        lines,
        [
            _box(column, y, node, node.name == name, others)
            for column in columns
            for y, node in _places(column, height)
        ],
    )


def _cut(names: list[ir.TypeName], package: str) -> list[_Node]:
    shown = [
        _Node(name, name.name if name.package == package else f"{name.package}/{name.name}")
        for name in names[:_MOST]
    ]
    rest = len(names) - _MOST
    return [*shown, _Node(None, f"and {rest} more")] if rest > 0 else shown


def _column(nodes: list[_Node], start: float) -> _Column:
    longest = max((len(node.text) for node in nodes), default=0)
    return _Column(nodes, start, longest * _CHARACTER + 24 if nodes else 0)


def _places(column: _Column, height: float) -> Iterator[tuple[float, _Node]]:
    """Yield the nodes, each with the middle of its height."""
    first = (height - len(column.nodes) * (_HEIGHT + _GAP) + _GAP) / 2 + _HEIGHT / 2
    for number, node in enumerate(column.nodes):
        yield first + number * (_HEIGHT + _GAP), node


def _line(here: tuple[float, float], there: tuple[float, float]) -> str:
    middle = (here[0] + there[0]) / 2
    return (
        f"M{here[0]:.0f},{here[1]:.0f} C{middle:.0f},{here[1]:.0f} "
        f"{middle:.0f},{there[1]:.0f} {there[0]:.0f},{there[1]:.0f}"
    )


def _box(
    column: _Column, y: float, node: _Node, own: bool, pages: Mapping[ir.TypeName, str]
) -> Box:
    return Box(
        x=f"{column.start:.0f}",
        y=f"{y - _HEIGHT / 2:.0f}",
        width=f"{column.width:.0f}",
        height=str(_HEIGHT),
        middle=f"{column.start + column.width / 2:.0f}",
        baseline=f"{y + 4.5:.0f}",
        text=node.text,
        own=own,
        page=pages.get(node.name, "") if node.name else "",
    )
