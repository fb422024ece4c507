"""Values of fixed size that are written together, and the position after them."""

from __future__ import annotations

import re
from functools import lru_cache

from idlc.emit.codec import wire_plan
from idlc.emit.codec.constants import Tables
from idlc.emit.codec.position import Position
from idlc.emit.codec.statements import Emitter, Note, Put
from idlc.emit.python_lines import Group, Node, call

_POSITIONS = re.compile(r"\b(?:at|low)\b")


class Frame:
    """Fixed-size values that follow each other, with at most one text: one Struct."""

    def __init__(self, start: Position) -> None:
        self.start = start.known
        self.fields: list[str] = []
        self.values: list[Node] = []
        self.text_size = ""
        self.widest = 1

    def phase(self) -> str:
        """Return the subscript that picks a Struct by the position, empty if one is enough."""
        if self.start.knows(self.widest):
            return ""
        return f"[low & {self.widest - 1}]" if self.widest <= 4 else "[at & 7]"


class Framing(Emitter):
    """Statements that write: those so far, the frame that grows, and the position after both."""

    def __init__(self, tables: Tables, here: Position) -> None:
        super().__init__()
        self.tables = tables
        self.here = here
        self.frame = Frame(here)

    def put(self, part: Node, reads: str = "") -> None:
        """Emit a part of the message."""
        self.body.append(Put(part, positions(reads)))

    def fixed(self, step: wire_plan.Step) -> None:
        """Add a value of fixed size to the frame."""
        match step:
            case wire_plan.Number(place, "?"):
                truths = self.tables.function("truths", "TRUTHS")
                self.field("?", 1, 1, f"{truths}[{place.text}]")
            case wire_plan.Number(place, letter, size):
                self.field(letter, size, size, place.text)
            case wire_plan.Block(place):
                value = call(self.tables.block_writer(step), place.text)
                self.field(step.token, step.unit, step.size, value)
            case _:
                self.field("x", 1, 1)

    def field(self, token: str, align: int, size: int, value: Node | None = None) -> None:
        """Add a value to the frame."""
        frame = self.frame
        frame.fields.append(token)
        frame.widest = max(frame.widest, align)
        if value is not None:
            frame.values.append(value)
        self.here.align(align)
        self.here.advance(size)

    def text(self, place: wire_plan.Place) -> None:
        """Add a string to the frame; a frame has at most one."""
        if self.frame.text_size:
            self.flush(4)
        size = self.tables.local(f"{place.local}_size")
        self.line(f"{place.text}.encode()", place.local)
        self.line(call("len", place.local), size)
        self.field("I", 4, 4, f"{size} + 1")
        self.frame.fields.append("*")
        self.frame.values.append(place.local)
        self.frame.text_size = size
        self.here.skip(size, 1)
        self.here.advance(1)

    def flush(self, align: int) -> None:
        """Write the frame; with the padding for a following `align` where that is known."""
        frame = self.frame
        if frame.fields:
            if max(frame.start.modulus, frame.widest) < align:
                align = 1
            frame.widest = max(frame.widest, align)
            phase = frame.phase()
            start = None if phase else frame.start.residue
            writer = self.tables.writer("".join(frame.fields), bool(frame.text_size), start, align)
            key = f"[{frame.text_size}]" if frame.text_size else ""
            method = ".pack" if phase and not key else ""
            self.put(Group(f"{writer}{phase}{key}{method}", tuple(frame.values)), phase)
            self.here.align(align)
        self.settle()

    def settle(self) -> None:
        """Note the position in `at` and `low`, and begin a new frame there."""
        here = self.here
        for target, value in here.before:
            self.note(target, value)
        here.before.clear()
        if not here.constant:
            self.note("at", here.text)
            if not here.known.knows(4):
                self.note("low", here.low)
            self.here = Position.variable(here.known)
        self.frame = Frame(self.here)

    def pad(self, align: int, unless_empty: str = "") -> None:
        """Emit padding as a part of its own."""
        here = self.here
        if here.known.is_at(align):
            return
        phase = "[at & 7]" if align == 8 else "[low & 3]"
        index = f"[{here.known.residue}]" if here.known.knows(align) else phase
        part = f"{self.tables.pad(align)}{index}"
        self.put(f'{part} if {unless_empty} else b""' if unless_empty else part, index)
        if not unless_empty:
            here.align(align)

    def note(self, target: str, value: str) -> None:
        """Note a position; dropped later unless it is read."""
        value = without_parentheses(value)
        if target != value:
            self.body.append(Note(target, value, positions(value)))


@lru_cache(maxsize=1024)  # few are different
def positions(expression: str) -> frozenset[str]:
    """Return the variables in an expression that hold positions."""
    return frozenset(_POSITIONS.findall(expression))


def without_parentheses(value: str) -> str:
    """Return an expression without parentheses around all of it."""
    if not value.startswith("("):
        return value
    depth = 0
    for place, character in enumerate(value):
        depth += (character == "(") - (character == ")")
        if depth == 0 and place < len(value) - 1:
            return value
    return value[1:-1]
