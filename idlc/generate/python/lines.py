"""Statements of codecs as lines: a run of values has one to a line, all else is on one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import msgspec


class Group(msgspec.Struct, frozen=True):
    """A run of values: `before` and, between brackets, one item to a line if there are several.

    Round brackets with nothing before them are a tuple, also around one item.
    """

    before: str
    items: tuple[Node, ...]
    brackets: str = "()"

    @property
    def is_flat(self) -> bool:
        """True if it is on one line."""
        return len(self.items) < 2 and all(isinstance(i, str) or i.is_flat for i in self.items)

    def flat(self) -> str:
        """Return the group on one line."""
        inner = ", ".join([item if isinstance(item, str) else item.flat() for item in self.items])
        if len(self.items) == 1 and self.brackets == "()" and not self.before:
            inner += ","
        return f"{self.before}{self.brackets[0]}{inner}{self.brackets[1]}"


class Comprehension(msgspec.Struct, frozen=True):
    """A list comprehension: its element; the targets and iterable of each `for`."""

    element: Node
    loops: tuple[tuple[str, str], ...]

    @property
    def is_flat(self) -> bool:
        """True if it is on one line."""
        return isinstance(self.element, str) or self.element.is_flat

    @property
    def clauses(self) -> list[str]:
        """All that follows the element."""
        return [f"for {targets} in {values}" for targets, values in self.loops]

    def flat(self) -> str:
        """Return the comprehension on one line."""
        element = self.element if isinstance(self.element, str) else self.element.flat()
        return f"[{element} {' '.join(self.clauses)}]"


Node: TypeAlias = str | Group | Comprehension


def call(function: str, *arguments: str) -> str:
    """Return a call on one line."""
    return f"{function}({', '.join(arguments)})"


def layout_lines(node: Node, indent: int, before: str = "", after: str = "") -> list[str]:
    """Return `before`, the node and `after` as lines, indented by `indent` columns."""
    margin = " " * indent
    if isinstance(node, str):
        return [f"{margin}{before}{node}{after}"]
    if node.is_flat:
        return [f"{margin}{before}{node.flat()}{after}"]
    if isinstance(node, Comprehension):
        inner = layout_lines(node.element, indent + 4)
        inner += [f"{margin}    {clause}" for clause in node.clauses]
        return [f"{margin}{before}[", *inner, f"{margin}]{after}"]
    if node.before and len(node.items) == 1:
        return layout_lines(node.items[0], indent, f"{before}{node.before}(", f"){after}")
    inner = [line for item in node.items for line in layout_lines(item, indent + 4, "", ",")]
    opening = f"{margin}{before}{node.before}{node.brackets[0]}"
    return [opening, *inner, f"{margin}{node.brackets[1]}{after}"]


def assign(target: Node, value: Node, indent: int, operator: str = "=") -> list[str]:
    """Return an assignment as lines."""
    *targets, last = layout_lines(target, indent)
    return [*targets, *layout_lines(value, indent, f"{last.strip()} {operator} ")]


def any_of(conditions: Sequence[str], indent: int, before: str, after: str) -> list[str]:
    """Return the lines of `before`, whether any condition is true, and `after`."""
    margin = " " * indent
    first, *rest = conditions
    if not rest:
        return [f"{margin}{before}{first}{after}"]
    return [
        f"{margin}{before}(",
        f"{margin}    {first}",
        *(f"{margin}    or {condition}" for condition in rest),
        f"{margin}){after}",
    ]
