"""Python statements as lines, broken as ruff breaks them.

In: expressions as text, or as a `Group` where they may be broken. Out: lines without indentation
errors: a statement that fits stays on one line, otherwise each item of a group gets a line of its
own and a trailing comma, which formatters keep.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import msgspec

#: Columns in generated packages; other files get a width of their own.
WIDTH = 88


class Group(msgspec.Struct, frozen=True):
    """A call, list, dictionary or tuple: `before`, the items between brackets, `after`.

    Round brackets with nothing before them are a tuple, also around one item.
    """

    before: str
    items: tuple[Node, ...]
    after: str = ""
    brackets: str = "()"

    def flat(self) -> str:
        """Return the group on one line."""
        # a list, and no call for a str: half of all rendering passes through here
        inner = ", ".join([item if isinstance(item, str) else item.flat() for item in self.items])
        if len(self.items) == 1 and self.brackets == "()" and not self.before:
            inner += ","
        return f"{self.before}{self.brackets[0]}{inner}{self.brackets[1]}{self.after}"


class Comprehension(msgspec.Struct, frozen=True):
    """A list comprehension: its element; the targets and iterable of each `for`."""

    element: Node
    loops: tuple[tuple[str, Node], ...]

    def flat(self) -> str:
        """Return the comprehension on one line."""
        loops = (f"for {targets} in {flat(values)}" for targets, values in self.loops)
        return f"[{flat(self.element)} {' '.join(loops)}]"


Node: TypeAlias = str | Group | Comprehension


def tuple_of(*items: Node) -> Group:
    """Return a tuple, of values or of targets."""
    return Group("", items)


def call(function: str, *arguments: Node) -> Group:
    """Return a call."""
    return Group(function, arguments)


def flat(node: Node) -> str:
    """Return a node on one line."""
    return node if isinstance(node, str) else node.flat()


def layout_lines(
    node: Node, indent: int, before: str = "", after: str = "", width: int = 0
) -> list[str]:
    """Return `before`, the node and `after` as lines, indented by `indent` columns."""
    margin = " " * indent
    width = width or WIDTH
    if isinstance(node, str):
        return [f"{margin}{before}{node}{after}"]
    line = f"{margin}{before}{node.flat()}{after}"
    if len(line) <= width:
        return [line]
    if isinstance(node, Comprehension):
        body = [f"{margin}    {node.flat()[1:-1]}"]
        if len(body[0]) > width:
            body = layout_lines(node.element, indent + 4, width=width)
            for targets, values in node.loops:
                body += layout_lines(values, indent + 4, f"for {targets} in ", width=width)
        return [f"{margin}{before}[", *body, f"{margin}]{after}"]
    return _broken(node, indent, before, f"{node.after}{after}", width)


def _broken(
    group: Group, indent: int, before: str = "", after: str = "", width: int = 0
) -> list[str]:
    """Return a group with each item on a line of its own; a comma follows each."""
    margin = " " * indent
    result = [f"{margin}{before}{group.before}{group.brackets[0]}"]
    for item in group.items:
        result += layout_lines(item, indent + 4, "", ",", width)
    result.append(f"{margin}{group.brackets[1]}{after}")
    return result


def import_from(module: str, names: Sequence[str], indent: int = 0, width: int = 0) -> list[str]:
    """Return the lines of an import statement."""
    margin = " " * indent
    line = f"{margin}from {module} import {', '.join(names)}"
    if len(line) <= (width or WIDTH) or " as " in line:
        return [line]
    items = [f"{margin}    {name}," for name in names]
    return [f"{margin}from {module} import (", *items, f"{margin})"]


def _spread(conditions: Sequence[str], word: str, indent: int) -> list[str]:
    """Return conditions joined by a word, on one line, or on one each."""
    margin = " " * indent
    line = f"{margin}{f' {word} '.join(conditions)}"
    if len(line) <= WIDTH:
        return [line]
    return [f"{margin}{conditions[0]}", *(f"{margin}{word} {each}" for each in conditions[1:])]


def any_of(conditions: list[str], indent: int, before: str, after: str) -> list[str]:
    """Return the lines of `before`, whether any condition is true, and `after`."""
    margin = " " * indent
    line = f"{margin}{before}{' or '.join(conditions)}{after}"
    if len(line) <= WIDTH:
        return [line]
    brackets = ("", "") if before.endswith("(") else ("(", ")")
    return [
        f"{margin}{before}{brackets[0]}",
        *_spread(conditions, "or", indent + 4),
        f"{margin}{brackets[1]}{after}",
    ]


def assign(target: Node, value: Node, indent: int, operator: str = "=") -> list[str]:
    """Return an assignment as lines."""
    margin = " " * indent
    left = flat(target)
    if isinstance(target, Group) and len(target.items) > 1:
        left = left[1:-1]  # as formatters have it
    line = f"{margin}{left} {operator} {flat(value)}"
    if len(line) <= WIDTH:
        return [line]
    if isinstance(target, Group):
        *targets, last = _broken(target, indent)
        return [*targets, *assign(last.strip(), value, indent, operator)]
    if not isinstance(value, str):
        return layout_lines(value, indent, f"{left} {operator} ")
    if len(margin) + 4 + len(value) <= WIDTH:
        return [f"{margin}{left} {operator} (", f"{margin}    {value}", f"{margin})"]
    return [line]
