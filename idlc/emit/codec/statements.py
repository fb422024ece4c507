"""Statements of an emitted function before they are text, and what can be dropped from them.

The encoder notes the position after every value whose size is not constant; most of these notes
are never read. `prune` drops them, `text_of` turns the rest into lines.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TypeAlias

import msgspec

from idlc.emit.python_lines import Group, Node, any_of, assign, lines


class Line(msgspec.Struct, frozen=True):
    """A statement without effect on the position: `target = value`, or `value` alone."""

    value: Node
    target: Node = ""
    operator: str = "="


class Put(msgspec.Struct, frozen=True):
    """A part of the message; `reads` names the position variables in it."""

    part: Node
    reads: frozenset[str] = frozenset()


class Note(msgspec.Struct, frozen=True):
    """An update of a position variable, without other effect."""

    target: str
    value: str
    reads: frozenset[str]


class Block(msgspec.Struct, frozen=True):
    """A compound statement; a loop runs any number of times, a branch at most once."""

    head: str
    body: tuple[Statement, ...]


Statement: TypeAlias = Line | Put | Note | Block


class Emitter:
    """The statements so far."""

    def __init__(self) -> None:
        self.body: list[Statement] = []

    def line(self, value: Node, target: Node = "") -> None:
        """Emit a statement without effect on the position."""
        self.body.append(Line(value, target))

    @contextmanager
    def within(self, head: str) -> Iterator[None]:
        """Make what is emitted meanwhile the body of a compound statement."""
        outside, self.body = self.body, []
        yield
        outside.append(Block(head, tuple(self.body)))
        self.body = outside


def prune(body: tuple[Statement, ...], live: frozenset[str]) -> tuple[Statement, ...]:
    """Return the statements without the notes that nothing reads; `live` is read afterwards."""
    return tuple(reversed(_prune(body, live)[0]))


def _prune(
    body: tuple[Statement, ...], live: frozenset[str]
) -> tuple[list[Statement], frozenset[str]]:
    kept: list[Statement] = []
    for statement in reversed(body):
        match statement:
            case Note(target, _, reads):
                if target not in live:
                    continue
                live = live - {target} | reads
            case Put(_, reads):
                live |= reads
            case Block(head, inner):
                remaining, before = _prune(inner, live)
                while not before <= live:
                    live |= before
                    remaining, before = _prune(inner, live)
                if not remaining:
                    continue
                statement = Block(head, tuple(reversed(remaining)))
        kept.append(statement)
    return kept, live


def text_of(body: tuple[Statement, ...], indent: int) -> list[str]:
    """Return the statements of a function as lines, each part appended by `put`."""
    result: list[str] = []
    for statement in body:
        match statement:
            case Line(value, target, operator):
                if target:
                    result += assign(target, value, indent, operator)
                else:
                    result += lines(value, indent)
            case Block(head, inner):
                result.append(" " * indent + head)
                result += text_of(inner, indent + 4)
            case Note(target, value):
                result += assign(target, value, indent)
            case Put(part):
                result += lines(Group("put", (part,)), indent)
    return result


def _interferes(statement: Statement, waiting: list[Put]) -> bool:
    """Return whether a statement must not run before the parts that wait to be put."""
    match statement:
        case Note(target):
            return any(target in put.reads for put in waiting)
        case Block(_, inner):
            return any(isinstance(s, Put) or _interferes(s, waiting) for s in inner)
        case _:
            return False


def function(body: tuple[Statement, ...], indent: int, again: tuple[str, ...]) -> list[str]:
    """Return the lines of a function that returns what `join` makes of its parts.

    Parts are collected as long as no position that they read changes. If one of the conditions
    of `again` is true in the end, the function begins anew.
    """
    result: list[str] = []
    waiting: list[Put] = []
    begun = False

    def flush(*, last: bool = False) -> None:
        nonlocal begun
        parts = tuple(put.part for put in waiting)
        waiting.clear()
        if not begun:
            begun = True
            result.extend(assign("parts", Group("", parts, brackets="[]"), indent))
            if not last:
                result.extend(assign("put", "parts.append", indent))
        else:
            for part in parts:
                result.extend(lines(Group("put", (part,)), indent))

    for statement in body:
        match statement:
            case Put():
                waiting.append(statement)
                continue
            case _ if _interferes(statement, waiting):
                flush()
            case _:
                pass
        result += text_of((statement,), indent)
    if waiting:
        flush(last=True)
    return result + _joined(again, indent)


def _joined(again: tuple[str, ...], indent: int) -> list[str]:
    margin = " " * indent
    if not again:
        return [f"{margin}return join(parts)"]
    return [
        f"{margin}raw = join(parts)",
        *any_of(list(again), indent, "if ", ":"),
        f"{margin}    return encode(message, join)",
        f"{margin}return raw",
    ]
