"""Statements of codecs: their lines, and building them by the positions of values in a message.

A run of values has one to a line; all else is on one line.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import msgspec
from msgspec.structs import replace

from idlc.model import ir, python_names
from idlc.wire import plan
from idlc.wire.layout import Alignment, multiple_of


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


class Cursor(msgspec.Struct, frozen=True):
    """The position `base + offset`, or `offset` alone, counted from the start of the buffer.

    `masked` says that `base` ends with `& -4` or the like, `reads` that it has a variable in which
    a position was stored.
    """

    base: str
    offset: int
    alignment: Alignment
    masked: bool = False
    reads: bool = False

    def text(self, by: int = 0) -> str:
        """Return the position `by` bytes further as an expression."""
        offset = self.offset + by
        if not self.base:
            return str(offset)
        base = f"({self.base})" if self.masked and offset else self.base
        if offset < 0:
            return f"{base} - {-offset}"
        return f"{base} + {offset}" if offset else base

    def skip(self, size: int) -> Cursor:
        """Return the position `size` bytes further."""
        return replace(self, offset=self.offset + size, alignment=self.alignment.after(size))

    def skip_by(self, size: str, modulus: int) -> Cursor:
        """Return the position further by an expression, which is a multiple of `modulus`."""
        base = f"({self.base})" if self.masked else self.base
        base = f"{base} + {size}" if base else size
        return replace(self, base=base, alignment=self.alignment.modulo(modulus), masked=False)

    def aligned(self, align: int) -> Cursor:
        """Return the next multiple of `align`, counted from the end of the header."""
        if self.alignment.knows(align):
            return self.skip(self.alignment.padding(align))
        lead = 4 % align
        base = f"{self.text(align - 1 - lead)} & -{align}"
        return Cursor(base, lead, multiple_of(align), True, self.reads)

    def at(self, base: str, offset: int = 0) -> Cursor:
        """Return the same position, held by another variable."""
        return Cursor(base, offset, self.alignment, reads=True)

    def with_alignment(self, alignment: Alignment) -> Cursor:
        """Return the same position with another known alignment."""
        return replace(self, alignment=alignment)


class ValueRun:
    """Fixed-size values that are written or read together; `path` is that of the first.

    `values` are what is written, or where what is read is stored.
    """

    def __init__(self) -> None:
        self.path = ""
        self.fields: list[str] = []
        self.values: list[Expression] = []
        self.widest = 1

    def add(self, code: str, align: int, value: Expression, path: str) -> None:
        """Add a value, unless that is empty."""
        self.path = self.path or path
        self.fields.append(code)
        self.widest = max(self.widest, align)
        if value:
            self.values.append(value)


class Builder:
    """The statements so far, and the position after them; `looping`: they are in a loop."""

    def __init__(self, tables: NamedExpressions, position: Cursor) -> None:
        self.tables = tables
        self.position = position
        self.body: list[CodeStatement] = []
        self.looping = False

    def line(self, value: Expression, target: Expression = "") -> None:
        """Emit a statement without effect on the position."""
        self.body.append(PlainStatement(value, target))

    def store_position(self, base: str, offset: int = 0) -> None:
        """Store the position in the variable `base`, as `base + offset`."""
        value = self.position.text(-offset)
        if value != base:
            self.body.append(Note(value, self.position.reads, base))
        self.position = self.position.at(base, offset)

    def loop(self, head: str, emit: Callable[[], None]) -> None:
        """Emit a loop; `emit` emits its body, until the known alignment holds for each round.

        Between two rounds the position is in `at`, or in `end` if the body ends with a string.
        """
        entry, first = self.position, self.position.at("at")
        outside, looping, self.looping = self.body, self.looping, True
        while True:
            mark = self.tables.mark()
            self.body, self.position = [], first
            emit()
            again = first.with_alignment(first.alignment.meet(self.position.alignment))
            if first.base == "at" and self.position.base == "end":
                again = again.at("end", self.position.offset)
            self.store_position(again.base, again.offset)
            if again == first:
                break
            first = again
            self.tables.reset(mark)
        loop, self.body = CompoundStatement(head, tuple(self.body)), outside
        self.looping, self.position = looping, entry
        self.store_position(first.base, first.offset)
        self.body.append(loop)
        self.position = first


class NamedExpressions:
    """Gives each distinct expression one name, in order of first use.

    `has_arrays`: expressions need the module of arrays; `has_texts`: a layout has a text.
    """

    def __init__(self, names: python_names.Locals) -> None:
        self._names = names
        self._definitions: dict[tuple[str, str], str] = {}
        self.has_arrays = False
        self.has_texts = False

    @property
    def definitions(self) -> tuple[CodeStatement, ...]:
        """Assignments of the expressions to their names, in order of first use."""
        return tuple(PlainStatement(value, name) for (_, value), name in self._definitions.items())

    def local(self, name: str) -> str:
        """Return a free local variable."""
        return self._names.new(name)

    def mark(self) -> tuple[dict[tuple[str, str], str], frozenset[str]]:
        """Return a snapshot for `reset`: the definitions and names so far."""
        return self._definitions.copy(), self._names.mark()

    def reset(self, mark: tuple[dict[tuple[str, str], str], frozenset[str]]) -> None:
        """Forget everything named since `mark`."""
        self._definitions, names = mark
        self._names.reset(names)

    def define(self, name: str, expression: str) -> str:
        """Return the name of an expression: `name`, or one like it that is free."""
        key = name, expression
        if key not in self._definitions:
            self._definitions[key] = self._names.new(name)
        return self._definitions[key]

    def function(self, name: str, expression: str) -> str:
        """Return the name of a runtime function."""
        return self.define(name, f"_idlc.{expression}")

    def struct(
        self,
        verb: str,
        path: str,
        fields: list[str],
        start: int | None,
        method: str,
        align: int = 1,
    ) -> str:
        """Return a method of the Struct of values, or without `start` a table by position.

        With a text among the values, it is a table by the size of the text. All are named by the
        `path` of the first value; those of a count or text anywhere are the same.
        """
        word = {("I",): "count", ("I", "*"): "text"}.get(tuple(fields))
        if word and align <= 4 and method != "iter_unpack":
            path = word if align == 1 else f"{word}_{align}"
            start = None if start is None else start % 4
        arguments = ["order", f'"{"".join(fields)}"']
        arguments += [f"start={start}"] if start else []
        arguments += [f"align={align}"] if align > 1 else []
        has_text = "*" in fields
        self.has_texts |= has_text
        name = f"{verb}_{path}"
        if start is None:
            return self.function(
                f"{name}_at", call("text_phases" if has_text else "phases", *arguments)
            )
        if has_text:
            return self.function(name, call("Texts", *arguments))
        return self.function(name, f"{call('layout', *arguments)}.{method}")

    def array(self, stem: str, function: str, step: plan.NumberBlock, *more: str) -> str:
        """Return a function of the runtime for fixed-size arrays of numbers."""
        self.has_arrays = True
        dtype = ir.PRIMITIVES[step.primitive].dtype
        arguments = ("order", f'"{dtype}"', str(step.count), *more)
        return self.define(f"{stem}_{dtype}_{step.count}", call(f"_arrays.{function}", *arguments))
