"""Statements of an emitted function before they are text, and the removal of unread ones.

The encoder notes the position after every value whose size is not constant; most of these notes
are never read. `prune` drops them, `text_of` turns the rest into lines.
"""

from __future__ import annotations

import json
from collections.abc import Hashable, Iterator
from contextlib import contextmanager
from typing import NamedTuple, TypeAlias

import msgspec

from idlc.generate.python.lines import Group, Node, any_of, assign, call, layout_lines
from idlc.model import ir, python_names
from idlc.model.names import snake_case
from idlc.wire import plan
from idlc.wire.layout import Alignment, multiple_of

#: Expressions longer than this are set aside.
LONG = 40


class Position:
    """A position counted from the start of the buffer, as far as it is known.

    Its value is `text`, an expression over the variable `at`, or a number while nothing of
    variable size came before. `low` agrees with it modulo 4 and is an expression over sizes since
    the last multiple of 4. `before` are assignments that both expressions rely on.
    """

    def __init__(self, alignment: Alignment, base: str = "", low: str = "") -> None:
        self.alignment = alignment
        self._base = base
        self._offset = 0
        self._low = low
        self._low_offset = 0
        self.before: list[tuple[str, str]] = []

    @classmethod
    def variable(cls, alignment: Alignment) -> Position:
        """Return a position that is in `at` and, modulo 4, in `low`."""
        return cls(alignment, "at", "low")

    @property
    def constant(self) -> bool:
        """True if the position is a number."""
        return not self._base

    @property
    def text(self) -> str:
        """The position as an expression."""
        return _sum(self._base, self._offset)

    @property
    def low(self) -> str:
        """An expression that is equal to the position modulo 4."""
        if self.alignment.knows(4):
            return str(self.alignment.residue % 4)
        return _sum(self._low, self._low_offset % 4)

    def advance(self, size: int) -> None:
        """Go `size` bytes ahead."""
        self._offset += size
        self._low_offset += size
        self.alignment = self.alignment.after(size)

    def align(self, align: int) -> None:
        """Go to the next multiple of `align`, counted from the end of the header."""
        if self.alignment.knows(align):
            self.advance(self.alignment.padding(align))
            return
        self.shorten()
        self._base, self._offset = _align_up(self._base, self._offset, align)
        self._low, self._low_offset = _align_up(self._low, self._low_offset, align)
        self.alignment = multiple_of(align)

    def skip(self, size: str, modulus: int) -> None:
        """Go ahead by an expression, which is a multiple of `modulus`."""
        if self.alignment.knows(4):
            self._low, self._low_offset = "", self.alignment.residue % 4
        self._base = _plus(self._base, size)
        self._low = _plus(self._low, size)
        self.alignment = self.alignment.modulo(modulus)

    def shorten(self) -> None:
        """Set a long expression aside as a statement of its own."""
        if len(self.text) > LONG:
            self.before.append(("at", self.text))
            self._base, self._offset = "at", 0
        if not self.alignment.knows(4) and len(self.low) > LONG:
            self.before.append(("low", self.low))
            self._low, self._low_offset = "low", 0


def aligned_to_8(position: str) -> str:
    """Return the expression of the next multiple of 8 from an expression on."""
    base, offset = _align_up(position, 0, 8)
    return f"{base} + {offset}"


def _align_up(base: str, offset: int, align: int) -> tuple[str, int]:
    if align == 8:
        return f"({_sum(base, offset + 3)} & -8)", 4
    return f"({_sum(base, offset + align - 1)} & -{align})", 0


def _plus(base: str, size: str) -> str:
    return f"{base} + {size}" if base else size


def _sum(base: str, offset: int) -> str:
    if not base:
        return str(offset)
    return f"{base} + {offset}" if offset else base


class Cursor(msgspec.Struct, frozen=True):
    """The position `base + offset`, or `offset` alone."""

    base: str
    offset: int
    alignment: Alignment

    def text(self, by: int = 0) -> str:
        """Return the position `by` bytes further as an expression."""
        offset = self.offset + by
        if not self.base:
            return str(offset)
        if offset < 0:
            return f"{self.base} - {-offset}"
        return f"{self.base} + {offset}" if offset else self.base

    def skip(self, size: int) -> Cursor:
        """Return the position `size` bytes further."""
        return Cursor(self.base, self.offset + size, self.alignment.after(size))

    def at(self, base: str, offset: int = 0) -> Cursor:
        """Return the same position, held by another variable."""
        return Cursor(base, offset, self.alignment)

    def with_alignment(self, alignment: Alignment) -> Cursor:
        """Return the same position with another known alignment."""
        return Cursor(self.base, self.offset, alignment)


#: The end of the header.
START = Cursor("", 4, Alignment(8, 4))


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
        """Put the statements emitted meanwhile into the body of a compound statement."""
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
                    result += layout_lines(value, indent)
            case Block(head, inner):
                result.append(" " * indent + head)
                result += text_of(inner, indent + 4)
            case Note(target, value):
                result += assign(target, value, indent)
            case Put(part):
                result += layout_lines(Group("put", (part,)), indent)
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
    """Return the lines of a function that returns the result of `join` for its parts.

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
                result.append(f"{' ' * indent}put = parts.append")
        else:
            for part in parts:
                result.extend(layout_lines(Group("put", (part,)), indent))

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
    if not begun and not again:
        parts = Group("", tuple(put.part for put in waiting), brackets="[]")
        return result + layout_lines(Group("join", (parts,)), indent, "return ")
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


class Mark(NamedTuple):
    """A snapshot of the names defined so far."""

    definitions: dict[Hashable, tuple[str, Node]]
    names: frozenset[str]


class Tables:
    """Gives each distinct expression one name, in order of first use."""

    def __init__(self, names: python_names.Locals) -> None:
        self._names = names
        self._definitions: dict[Hashable, tuple[str, Node]] = {}

    @property
    def definitions(self) -> tuple[tuple[str, Node], ...]:
        """Names and expressions, in order of first use."""
        return tuple(self._definitions.values())

    def local(self, name: str) -> str:
        """Return a free local variable."""
        return self._names.new(name)

    def mark(self) -> Mark:
        """Return a snapshot for `reset`."""
        return Mark(self._definitions.copy(), self._names.mark())

    def reset(self, mark: Mark) -> None:
        """Forget everything named since `mark`."""
        self._definitions = mark.definitions
        self._names.reset(mark.names)

    def define(self, name: str, key: Hashable, expression: Node) -> str:
        """Return the name of an expression, making it on first use of `key`."""
        definition = self._definitions.get(key)
        if definition is None:
            definition = self._definitions[key] = (self._names.new(name), expression)
        return definition[0]

    def ordered_call(self, name: str, function: str, *arguments: str, after: str = "") -> str:
        """Return the name of a runtime function's result for the byte order."""
        value = call(f"_idlc.{function}", "order", *arguments) + after
        return self.define(name, (name, value), value)

    def function(self, name: str, expression: str) -> str:
        """Return the name of a runtime function."""
        return self.define(name, expression, f"_idlc.{expression}")

    def reader(self, path: str, fields: str, start: int | None) -> str:
        """Return the reader of a group: a function, or without `start` a table by position.

        It is named by the `path` of the value that it begins with, as all readers and writers are.
        """
        path, start = _shared(path, fields, start, 1)
        if start is None:
            return self.ordered_call(f"read_{path}_at", "phases", f'"{fields}"')
        arguments = (f'"{fields}"', f"start={start}") if start else (f'"{fields}"',)
        return self.ordered_call(f"read_{path}", "layout", *arguments, after=".unpack_from")

    def rows(self, path: str, fields: str) -> str:
        """Return the function that yields the values of one structure after the other."""
        name = f"read_{path}"
        return self.ordered_call(name, "layout", f'"{fields}"', "start=4", after=".iter_unpack")

    def writer(self, path: str, fields: str, start: int | None, align: int) -> str:
        """Return the writer of a group: a function, or a table by text size or by position."""
        texts = "*" in fields
        path, start = _shared(path, fields, start, align)
        arguments = [f'"{fields}"']
        if start:
            arguments.append(f"start={start}")
        if align > 1:
            arguments.append(f"align={align}")
        if start is None:
            function = "text_phases" if texts else "phases"
            return self.ordered_call(f"write_{path}_at", function, *arguments)
        if texts:
            return self.ordered_call(f"write_{path}", "Texts", *arguments)
        return self.ordered_call(f"write_{path}", "layout", *arguments, after=".pack")

    def pad(self, align: int) -> str:
        """Return the table of padding to `align`, by position."""
        return self.function(f"pad{align}", f"PAD{align}")

    def gap(self, size: int) -> str:
        """Return an expression for `size` zero bytes."""
        return 'b"' + "\\x00" * size + '"'

    def block_writer(self, step: plan.Block) -> str:
        """Return the function that turns a fixed-size array into bytes."""
        if step.primitive in plan.LIST_PRIMITIVES:
            kind = plan.LIST_PRIMITIVES[step.primitive]
            name = f"{kind}_{step.count}"
            return self.define(name, name, f"_idlc.{kind}_writer({step.count})")
        return self._array("bytes_of", "array_writer", step)

    def buffer_writer(self, step: plan.Block) -> str:
        """Return the function that turns a fixed-size array into any kind of buffer."""
        if step.primitive in plan.LIST_PRIMITIVES:
            return self.block_writer(step)
        return self._array("buffer_of", "buffer_writer", step)

    def block_reader(self, step: plan.Block) -> str:
        """Return the function that turns bytes into a fixed-size array."""
        if step.primitive in plan.LIST_PRIMITIVES:
            return self.list_reader(step.primitive)
        return self._array("array_of", "array_reader", step, "reading")

    def list_reader(self, primitive: str) -> str:
        """Return the function that turns bytes into a list of bools or bytes."""
        kind = plan.LIST_PRIMITIVES[primitive]
        return self.function(f"list_of_{kind}", f"read_{kind}")

    def _array(self, stem: str, function: str, step: plan.Block, *more: str) -> str:
        dtype = ir.PRIMITIVES[step.primitive].dtype
        expression = call(f"_arrays.{function}", "order", json.dumps(dtype), str(step.count), *more)
        return self.define(f"{stem}_{dtype}_{step.count}", expression, expression)

    def sequence_writer(self, step: plan.Numbers) -> str:
        """Return the function that makes an array of another sequence of numbers."""
        expression = f'_idlc.sequence_writer(order, "{step.code}")'
        return self.define(f"array_of_{step.numpy}", expression, expression)

    def sequence_copier(self, step: plan.Numbers) -> str:
        """Return the function that turns a sequence of numbers into bytes."""
        expression = f'_idlc.sequence_copier(order, "{step.code}")'
        return self.define(f"bytes_of_{step.numpy}", expression, expression)

    def sequence_reader(self, step: plan.Numbers, foreign: str | None) -> str:
        """Return the function that turns a buffer into a sequence of numbers.

        `foreign` is the class that holds it, if that is of another package.
        """
        reading = f"reading.of({foreign})" if foreign else "reading"
        expression = f'_idlc.sequence_reader(order, "{step.code}", {reading})'
        name = f"{step.numpy}_of_{snake_case(foreign)}" if foreign else step.numpy
        return self.define(f"sequence_of_{name}", expression, expression)

    def texts_writer(self, step: plan.Texts) -> str:
        """Return the function that writes an array of strings; one for each field."""
        path = step.place.path
        arguments = ["order"]
        if step.size is not None:
            arguments.append(f"size={step.size}")
        elif step.bound is not None:
            arguments.append(f"bound={step.bound}")
        expression = call("_idlc.wide_block" if step.wide else "_idlc.text_block", *arguments)
        return self.define(f"write_{path}", f"write texts {path}", expression)

    def texts_reader(self, step: plan.Texts) -> str:
        """Return the function that reads an array of strings; one for each field."""
        path = step.place.path
        if step.wide:
            expression = call("_idlc.wide_texts_reader", "order")
        else:
            expression = call("_idlc.texts_reader", "order", self.text())
        return self.define(f"read_{path}", f"texts {path}", expression)

    def text(self) -> str:
        """Return the name of the function that makes a string of bytes."""
        return self.define("text", "text", "reading.text")

    def strings(self) -> str:
        """Return the name of the function that prepares reading many strings."""
        expression = call("_idlc.strings_reader", "order", "reading.text")
        return self.define("strings", "strings", expression)

    def small(self) -> str:
        """Return the name of the size up to which no view is worth its cost."""
        return self.define("small", "small", "reading.small")


def _shared(path: str, fields: str, start: int | None, align: int) -> tuple[str, int | None]:
    """Return the name and start of a layout: counts and texts anywhere have one in common."""
    word = {"I": "count", "I*": "text"}.get(fields)
    if word is None or align > 4:
        return path, start
    return word if align == 1 else f"{word}_{align}", None if start is None else start % 4
