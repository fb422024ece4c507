"""From a layout to the statements that write it.

Numbers that follow each other are written by one precompiled Struct; so is a string between
them, by one Struct for each of its sizes. Positions modulo 8 are followed as far as they are
known, so that padding is part of the Structs. After a string or a sequence of unknown size,
the statement picks the Struct by the position, which is noted in `at` (or, if 4 is enough, its
remainder in `low`) only where a later statement reads it.
"""

from __future__ import annotations

import re
from functools import lru_cache

import msgspec

from idlc.generate.python.lines import Comprehension, Group, Node, call
from idlc.generate.python.positions import (
    Block,
    Emitter,
    Line,
    Note,
    Position,
    Put,
    Tables,
    aligned_to_8,
    function,
    prune,
)
from idlc.wire import plan
from idlc.wire.layout import Alignment, multiple_of

_POSITIONS = re.compile(r"\b(?:at|low)\b")


class PackedGroup:
    """Fixed-size values that follow each other, with at most one text: one Struct.

    `path` is that of the first value.
    """

    def __init__(self, start: Position) -> None:
        self.start = start.alignment
        self.path = ""
        self.fields: list[str] = []
        self.values: list[Node] = []
        self.text_size = ""
        self.widest = 1

    def phase(self) -> str:
        """Return the subscript that picks a Struct by the position, empty if one is enough."""
        if self.start.knows(self.widest):
            return ""
        return f"[low & {self.widest - 1}]" if self.widest <= 4 else "[at & 7]"


class PackBuilder(Emitter):
    """Emits statements that write; `group` is not yet emitted, `position` is after it."""

    def __init__(self, tables: Tables, position: Position) -> None:
        super().__init__()
        self.tables = tables
        self.position = position
        self.group = PackedGroup(position)

    def put(self, part: Node, reads: str = "") -> None:
        """Emit a part of the message."""
        self.body.append(Put(part, positions(reads)))

    def fixed(self, step: plan.Step) -> None:
        """Add a value of fixed size to the group."""
        match step:
            case plan.Number(place, "?"):
                truths = self.tables.function("truths", "TRUTHS")
                self.field("?", 1, 1, f"{truths}[{place.text}]", place.path)
            case plan.Number(place, letter, size):
                self.field(letter, size, size, place.text, place.path)
            case plan.Block(place):
                value = call(self.tables.block_writer(step), place.text)
                self.field(step.token, step.unit, step.size, value, place.path)
            case _:
                self.field("x", 1, 1, None, "nothing")

    def field(self, token: str, align: int, size: int, value: Node | None, path: str) -> None:
        """Add a value to the group."""
        group = self.group
        group.path = group.path or path
        group.fields.append(token)
        group.widest = max(group.widest, align)
        if value is not None:
            group.values.append(value)
        self.position.align(align)
        self.position.advance(size)

    def text(self, place: plan.Place) -> None:
        """Add a string to the group; a group has at most one."""
        if self.group.text_size:
            self.flush(4)
        size = self.tables.local(f"{place.path}_size")
        self.line(f"{place.text}.encode()", place.local)
        self.line(call("len", place.local), size)
        self.field("I", 4, 4, f"{size} + 1", place.path)
        self.group.fields.append("*")
        self.group.values.append(place.local)
        self.group.text_size = size
        self.position.skip(size, 1)
        self.position.advance(1)

    def flush(self, align: int) -> None:
        """Emit the group, with the padding for a following `align` where that is known."""
        group = self.group
        if group.fields:
            if max(group.start.modulus, group.widest) < align:
                align = 1
            group.widest = max(group.widest, align)
            phase = group.phase()
            start = None if phase else group.start.residue
            writer = self.tables.writer(group.path, "".join(group.fields), start, align)
            key = f"[{group.text_size}]" if group.text_size else ""
            method = ".pack" if phase and not key else ""
            self.put(Group(f"{writer}{phase}{key}{method}", tuple(group.values)), phase)
            self.position.align(align)
        self.note_position()

    def note_position(self) -> None:
        """Note the position in `at` and `low`, and begin a new group there."""
        position = self.position
        for target, value in position.before:
            self.note(target, value)
        position.before.clear()
        if not position.constant:
            self.note("at", position.text)
            if not position.alignment.knows(4):
                self.note("low", position.low)
            self.position = Position.variable(position.alignment)
        self.group = PackedGroup(self.position)

    def pad(self, align: int, unless_empty: str = "") -> None:
        """Emit padding as a part of its own."""
        position = self.position
        if position.alignment.is_at(align):
            return
        phase = "[at & 7]" if align == 8 else "[low & 3]"
        index = f"[{position.alignment.residue}]" if position.alignment.knows(align) else phase
        part = f"{self.tables.pad(align)}{index}"
        self.put(f'{part} if {unless_empty} else b""' if unless_empty else part, index)
        if not unless_empty:
            position.align(align)

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


NONE: frozenset[str] = frozenset()


def encode(steps: tuple[plan.Step, ...], tables: Tables, indent: int) -> list[str]:
    """Return the lines that write a message; what they use is defined in `tables`."""
    encoder = _Encoder(tables, Position(Alignment()))
    encoder.field("4s", 1, 4, tables.function("encapsulation", "HEADERS[order]"), "head")
    for step in steps:
        encoder.step(step)
    encoder.flush(1)
    body = prune(tuple(encoder.body), NONE)
    return function(body, indent, tuple(encoder.again))


class _Encoder(PackBuilder):
    """Emits a message's steps."""

    def __init__(self, tables: Tables, position: Position) -> None:
        super().__init__(tables, position)
        #: Conditions that hold if another thread changed the length of an uncopied array.
        self.again: list[str] = []
        self.looping = False

    def step(self, step: plan.Step) -> None:
        """Emit one step."""
        match step:
            case plan.Block() if step.is_large:
                self.block(step)
            case plan.Number() | plan.Dummy() | plan.Block():
                self.fixed(step)
            case plan.Enter(place):
                if not step.empty:
                    self.line(place.text, place.local)
            case plan.Text(place, wide):
                if wide:
                    writer = self.tables.function("wide_text", "wide_text(order)")
                    self.buffer(place, call(writer, place.text), 4)
                else:
                    self.text(place)
            case plan.Bytes(place, primitive, bound):
                function = plan.LIST_PRIMITIVES[primitive]
                writer = self.tables.function(f"{function}_of", function)
                self.buffer(place, call(writer, place.text), 1, bound)
            case plan.Numbers():
                self.numbers(step)
            case plan.Texts():
                self.texts(step)
            case plan.Items():
                self.items(step)

    # Values of variable or large size are parts of their own.

    def block(self, step: plan.Block) -> None:
        """Emit a large array of fixed size."""
        self.flush(step.unit)
        self.pad(step.unit)
        self.put(call(self.tables.buffer_writer(step), step.place.text))
        self.position.advance(step.size)
        self.note_position()

    def check(self, condition: str, problem: str) -> None:
        """Emit a check; `validate` finds the field and the words afterwards."""
        raised = Line(f'raise ValueError("{problem}")')
        self.body.append(Block(f"if {condition}:", (raised,)))

    def bound(self, count: str, bound: int | None) -> None:
        """Check a sequence's upper limit."""
        if bound is not None:
            self.check(f"{count} > {bound}", "too many elements")

    def buffer(self, place: plan.Place, value: Node, unit: int, bound: int | None = None) -> None:
        """Emit the count of a buffer's units, and the buffer."""
        local = place.local
        self.line(value, local)
        self.bound(f"len({local})", bound)
        count = f"len({local})" if unit == 1 else f"len({local}) // {unit}"
        self.field("I", 4, 4, count, place.path)
        self.flush(1)
        self.put(local)
        self.position.skip(f"len({local})", unit)
        self.note_position()

    def numbers(self, step: plan.Numbers) -> None:
        """Emit a numeric sequence."""
        local = step.place.local
        count = self.tables.local(f"{step.place.path}_count")
        if self.looping:
            self.line(call(self.tables.sequence_copier(step), step.place.text), local)
            self.line(f"len({local})" + (f" // {step.unit}" if step.unit > 1 else ""), count)
        else:
            self.line(step.place.text, local)
            converted = Line(call(self.tables.sequence_writer(step), local), local)
            array = self.tables.function("array", "array_of(order)")
            self.body.append(Block(f"if type({local}) is not {array}:", (converted,)))
            self.line(f"len({local})", count)
            self.again.append(f"len({local}) != {count}")
        self.bound(count, step.bound)
        self.field("I", 4, 4, count, step.place.path)
        self.flush(1)
        repeat = plan.Fixed(step.unit, step.unit, step.unit)
        self.elements(local, count, repeat, unless=count)

    def texts(self, step: plan.Texts) -> None:
        """Emit an array or sequence of strings, its count included."""
        local = step.place.local
        self.flush(4)
        self.pad(4)
        self.line(call(self.tables.texts_writer(step), step.place.text), local)
        self.put(local)
        self.position.skip(f"len({local})", 4 if step.wide else 1)
        self.note_position()

    def count(self, step: plan.Items, count: str) -> None:
        """Emit the check of a size, or the count."""
        self.bound(count, step.bound)
        if step.size is None:
            self.field("I", 4, 4, count, step.place.path)
        else:
            self.check(f"{count} != {step.size}", "wrong number of elements")

    def rows(self, step: plan.Items) -> None:
        """Emit structures of strings: sizes and ends are looked up, all is encoded once."""
        local = step.place.local
        path = step.place.path
        rows, block = self.tables.local(f"{path}_rows"), self.tables.local(f"{path}_block")
        sized = self.tables.function("sized", "sizes(order)")
        ended = self.tables.function("ended", "ENDS")
        places = [part.place for part in step.body if isinstance(part, plan.Text)]
        parts = [
            part
            for name in (place.local for place in places)
            for part in (f"{sized}[len({name})]", name, f"{ended}[len({name})]")
        ]
        lines = [Line(place.text, place.local) for place in places]
        lines.append(Line(Group("", tuple(parts)), rows, "+="))
        loop = f"for {step.item} in {local}"
        values = Group("", tuple(place.text for place in places)).flat()
        texts = Comprehension("each", ((step.item, local), ("each", values)))
        unsized = call(self.tables.function("unsized", "unsized"), texts.flat())
        self.line(step.place.text, local)
        self.line("[]", f"{rows}: list[str]")
        attempt = Block("try:", (Block(f"{loop}:", tuple(lines)),))
        instead = Block("except IndexError:", (Line(unsized, rows),))
        self.body.append(Block(f"if len({local}):", (attempt, instead)))
        self.count(step, f"len({rows}) // {len(parts)}")
        self.flush(4)
        self.pad(4)
        self.line(call(self.tables.function("write_rows", "rows_writer(order)"), rows), block)
        self.put(block)
        self.position.skip(f"len({block})", 1)
        self.note_position()

    def items(self, step: plan.Items) -> None:
        """Emit an array or sequence of structures, as many as there are at one moment."""
        repeat = plan.fixed(step.body)
        only_texts = all(isinstance(part, plan.Text) and not part.wide for part in step.body)
        if only_texts and plan.is_many(step):
            self.rows(step)
            return
        local = step.place.local
        self.line(call(self.tables.function("listed", "listed"), step.place.text), local)
        self.count(step, f"len({local})")
        if repeat is None:
            self.loop(step)
        else:
            self.fused(step, repeat)

    def fused(self, step: plan.Items, repeat: plan.Fixed) -> None:
        """Emit structures of constant size: one Struct, one join."""
        local = step.place.local
        self.flush(1 if step.size is None else repeat.align)
        inner = _Encoder(self.tables, Position(Alignment(8, 4)))
        for part in inlined(step):
            inner.fixed(part)
        writer = self.tables.writer(step.item, "".join(inner.group.fields), 4, 1)
        row = Group(writer, tuple(inner.group.values))
        block = self.tables.local(f"{step.place.path}_block")
        gap = "\\x00" * (repeat.stride - repeat.size)
        blocks = Comprehension(row, ((step.item, local),))
        self.line(Group(f'b"{gap}".join', (blocks,)), block)
        self.elements(block, f"len({local})", repeat, unless=local if step.size is None else "")

    def elements(self, part: str, count: str, repeat: plan.Fixed, *, unless: str) -> None:
        """Emit elements of constant size; no padding goes before if `unless` is false."""
        gap = repeat.stride - repeat.size
        size = count if repeat.stride == 1 else f"{repeat.stride} * {count}"
        size += f" - {gap}" if gap else ""
        modulus = power_of_two(repeat.size, repeat.stride)
        if not unless or (self.position.alignment.is_at(repeat.align) and not gap):
            self.pad(repeat.align)
            self.put(part)
            self.position.skip(size, modulus)
        else:
            self.note_position()
            if self.position.constant:
                self.note("at", self.position.text)
            self.note("low", self.position.low)
            self.pad(repeat.align, unless)
            self.put(part)
            with self.within(f"if {unless}:"):
                start = aligned_to_8("at") if repeat.align == 8 else "at"
                self.note("at", f"{start} + {size}")
                self.note("low", size)
            self.position = Position.variable(multiple_of(4).modulo(modulus))
        self.note_position()

    def loop(self, step: plan.Items) -> None:
        """Emit structures one by one."""
        self.flush(1)
        entry = self.position
        if entry.constant:
            self.note("at", entry.text)
        if entry.alignment.knows(4):
            self.note("low", entry.low)
        head = entry.alignment
        looping, self.looping = self.looping, True
        while True:
            mark = self.tables.mark()
            with self.within(f"for {step.item} in {step.place.local}:"):
                self.position = Position.variable(head)
                self.group = PackedGroup(self.position)
                for part in step.body:
                    self.step(part)
                self.flush(1)
                end = self.position
                if end.alignment.knows(4) and not head.knows(4):
                    self.note("low", end.low)
            met = head.meet(end.alignment)
            if met == head:
                break
            head = met
            self.tables.reset(mark)
            self.body.pop()
        self.looping = looping
        self.position = Position.variable(head)
        self.group = PackedGroup(self.position)


def power_of_two(*sizes: int) -> int:
    """Return the largest power of two, up to 8, that divides all sizes."""
    return min(size & -size for size in (*sizes, 8))


def inlined(step: plan.Items) -> list[plan.Step]:
    """Return an element's fixed-size steps, with attribute chains instead of variables."""
    paths = {step.item: step.item}
    steps: list[plan.Step] = []
    for part in step.body:
        match part:
            case plan.Enter(place):
                paths[place.local] = f"{paths[place.owner]}.{place.slot}"
            case plan.Number(place, letter, size):
                moved = msgspec.structs.replace(place, owner=paths[place.owner])
                steps.append(plan.Number(moved, letter, size))
            case plan.Block(place, primitive, count):
                moved = msgspec.structs.replace(place, owner=paths[place.owner])
                steps.append(plan.Block(moved, primitive, count))
            case _:
                steps.append(part)
    return steps
