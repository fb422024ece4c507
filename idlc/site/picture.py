"""Who uses an interface, and what it uses, as an SVG picture: users left, used types right."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeAlias

from idlc.model import ir
from idlc.site.html import Pages, escape

_Node: TypeAlias = "tuple[ir.TypeName | None, str]"

_HEIGHT = 30
_GAP = 12
_CHARACTER = 7.3
_BETWEEN = 70
#: More neighbours than these make a picture that nobody reads.
_MOST = 14


def picture(
    name: ir.TypeName, users: Iterable[ir.TypeName], used: Iterable[ir.TypeName], pages: Pages
) -> str:
    """Return an SVG element; empty for an interface without neighbours."""
    left, right = sorted(users), sorted(used)
    if not left and not right:
        return ""
    own: list[_Node] = [(name, name.name)]
    columns = [_cut(left, name.package), own, _cut(right, name.package)]
    height = max(len(column) for column in columns) * (_HEIGHT + _GAP) + _GAP
    widths = [
        max((len(text) for _, text in column), default=0) * _CHARACTER + 24 if column else 0
        for column in columns
    ]
    starts = [1.0, 1.0 + widths[0] + (_BETWEEN if left else 0)]
    starts.append(starts[1] + widths[1] + _BETWEEN)
    total = starts[2] + widths[2] if right else starts[1] + widths[1]
    middle = height / 2
    parts = []
    for side, column in ((0, columns[0]), (2, columns[2])):
        for y, _ in _places(column, height):
            here = (
                (starts[side] + widths[side], y) if side == 0 else (starts[1] + widths[1], middle)
            )
            there = (starts[1], middle) if side == 0 else (starts[2], y)
            parts.append(_line(here, there))
    for column, start, width in zip(columns, starts, widths, strict=True):
        parts += [_box(start, y, width, one, name, pages) for y, one in _places(column, height)]
    label = escape(f"what uses {name.name}, and what it uses")
    return (
        f'<div class="picture"><svg role="img" aria-label="{label}" width="{total + 1:.0f}" '
        f'height="{height:.0f}" viewBox="0 0 {total + 1:.0f} {height:.0f}">\n'
        + "\n".join(parts)
        + "\n</svg></div>\n"
    )


def _cut(names: list[ir.TypeName], package: str) -> list[_Node]:
    shown: list[_Node] = [
        (name, name.name if name.package == package else f"{name.package}/{name.name}")
        for name in names[:_MOST]
    ]
    rest = len(names) - _MOST
    return [*shown, (None, f"and {rest} more")] if rest > 0 else shown


def _places(column: list[_Node], height: float) -> list[tuple[float, _Node]]:
    first = (height - len(column) * (_HEIGHT + _GAP) + _GAP) / 2 + _HEIGHT / 2
    return [(first + number * (_HEIGHT + _GAP), one) for number, one in enumerate(column)]


def _line(here: tuple[float, float], there: tuple[float, float]) -> str:
    middle = (here[0] + there[0]) / 2
    return (
        f'<path d="M{here[0]:.0f},{here[1]:.0f} C{middle:.0f},{here[1]:.0f} '
        f'{middle:.0f},{there[1]:.0f} {there[0]:.0f},{there[1]:.0f}"/>'
    )


def _box(x: float, y: float, width: float, node: _Node, own: ir.TypeName, pages: Pages) -> str:
    name, text = node
    kind = ' class="own"' if name == own else ""
    box = (
        f'<rect{kind} x="{x:.0f}" y="{y - _HEIGHT / 2:.0f}" width="{width:.0f}" '
        f'height="{_HEIGHT}" rx="5"/><text x="{x + width / 2:.0f}" y="{y + 4.5:.0f}">'
        f"{escape(text)}</text>"
    )
    if name is None or name == own or name not in pages:
        return box
    return f'<a href="../{escape(pages[name])}">{box}</a>'
