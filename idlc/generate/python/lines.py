"""Statements of codecs, and their lines: a run of values has one to a line, all else is on one."""

from __future__ import annotations

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


class Line(msgspec.Struct, frozen=True):
    """A statement without effect on the position: `target = value`, or `value` alone."""

    value: Node
    target: Node = ""
    operator: str = "="


class Put(msgspec.Struct, frozen=True):
    """A part of the message; `reads` tells that its bytes depend on `at`."""

    part: Node
    reads: bool = False


class Note(msgspec.Struct, frozen=True):
    """An update of `at`, without other effect; `reads` tells that it depends on `at` before."""

    value: str
    reads: bool


class Block(msgspec.Struct, frozen=True):
    """A compound statement; a loop runs any number of times, a branch at most once."""

    head: str
    body: tuple[Statement, ...]


Statement: TypeAlias = Line | Put | Note | Block


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


def text_of(body: tuple[Statement, ...], indent: int) -> list[str]:
    """Return statements as lines, each part of a message appended by `put`."""
    lines: list[str] = []
    for statement in body:
        match statement:
            case Line(value, "", _):
                lines += layout_lines(value, indent)
            case Line(value, target, operator):
                *targets, last = layout_lines(target, indent)
                lines += [*targets, *layout_lines(value, indent, f"{last.strip()} {operator} ")]
            case Note(value):
                lines += text_of((Line(value, "at"),), indent)
            case Put(part):
                lines += layout_lines(Group("put", (part,)), indent)
            case Block(head, inner):
                lines += [" " * indent + head, *text_of(inner, indent + 4)]
    return lines
