"""Statements of codecs, and their lines: a run of values has one to a line, all else is on one."""

from __future__ import annotations

from typing import TypeAlias

import msgspec


class Group(msgspec.Struct, frozen=True):
    """A run of values: `before` and, between brackets, one item to a line if there are several.

    Round brackets with nothing before them are a tuple, also around one item.
    """

    before: str
    items: tuple[Expression, ...]
    brackets: str = "()"


class Comprehension(msgspec.Struct, frozen=True):
    """A list comprehension: its element, and each `for` that follows."""

    element: Expression
    clauses: tuple[str, ...]


Expression: TypeAlias = str | Group | Comprehension


class PlainStatement(msgspec.Struct, frozen=True):
    """A statement without effect on the position: `target = value`, or `value` alone."""

    value: Expression
    target: Expression = ""
    operator: str = "="


class Put(msgspec.Struct, frozen=True):
    """A part of the message; `reads` tells that its bytes depend on `at`."""

    part: Expression
    reads: bool = False


class Note(msgspec.Struct, frozen=True):
    """An update of a position, by default `at`; `reads` tells that it depends on `at` before."""

    value: str
    reads: bool
    target: str = "at"


class CompoundStatement(msgspec.Struct, frozen=True):
    """A compound statement; a loop runs any number of times, a branch at most once."""

    head: str
    body: tuple[CodeStatement, ...]


CodeStatement: TypeAlias = PlainStatement | Put | Note | CompoundStatement


def call(function: str, *arguments: str) -> str:
    """Return a call on one line."""
    return f"{function}({', '.join(arguments)})"


def is_flat(node: Expression) -> bool:
    """Return whether a node is on one line."""
    match node:
        case Group(_, items):
            return len(items) < 2 and all(map(is_flat, items))
        case Comprehension(element):
            return is_flat(element)
        case _:
            return True


def flat(node: Expression) -> str:
    """Return a node on one line."""
    match node:
        case Group(before, items, brackets):
            comma = "," if len(items) == 1 and not before and brackets == "()" else ""
            return f"{before}{brackets[0]}{', '.join(map(flat, items))}{comma}{brackets[1]}"
        case Comprehension(element):
            return f"[{flat(element)} {' '.join(node.clauses)}]"
        case _:
            return node


def layout_lines(node: Expression, indent: int, before: str = "", after: str = "") -> list[str]:
    """Return `before`, the node and `after` as lines, indented by `indent` columns."""
    margin = " " * indent
    if isinstance(node, str) or is_flat(node):
        return [f"{margin}{before}{flat(node)}{after}"]
    if isinstance(node, Comprehension):
        inner = layout_lines(node.element, indent + 4)
        inner += [f"{margin}    {clause}" for clause in node.clauses]
        return [f"{margin}{before}[", *inner, f"{margin}]{after}"]
    if node.before and len(node.items) == 1:
        return layout_lines(node.items[0], indent, f"{before}{node.before}(", f"){after}")
    inner = [line for item in node.items for line in layout_lines(item, indent + 4, "", ",")]
    opening = f"{margin}{before}{node.before}{node.brackets[0]}"
    return [opening, *inner, f"{margin}{node.brackets[1]}{after}"]


def text_of(body: tuple[CodeStatement, ...], indent: int) -> list[str]:
    """Return statements as lines, each part of a message appended by `put`."""
    lines: list[str] = []
    for statement in body:
        match statement:
            case PlainStatement(value, "", _):
                lines += layout_lines(value, indent)
            case PlainStatement(value, target, operator):
                *targets, last = layout_lines(target, indent)
                lines += [*targets, *layout_lines(value, indent, f"{last.strip()} {operator} ")]
            case Note(value, _, target):
                lines += text_of((PlainStatement(value, target),), indent)
            case Put(part):
                lines += layout_lines(Group("put", (part,)), indent)
            case CompoundStatement(head, inner):
                lines += [" " * indent + head, *text_of(inner, indent + 4)]
    return lines
