"""From a layout to the statements that write it.

Numbers that follow each other are written by one precompiled Struct; so is a string between
them, by one Struct for each of its sizes. Positions modulo 8 are followed as far as they are
known, so that padding is part of the Structs. Where a string or a sequence made them unknown,
the statement picks the Struct by the position, which is noted in `at` (or, if 4 is enough, its
remainder in `low`) only where somebody reads it.
"""

from __future__ import annotations

import msgspec

from idlc.emit.codec import statements, wire_plan
from idlc.emit.codec.alignment import Alignment, multiple_of
from idlc.emit.codec.constants import Tables
from idlc.emit.codec.frames import Frame, Framing
from idlc.emit.codec.position import Position, aligned_to_8
from idlc.emit.python_lines import Comprehension, Group, Node, call, tuple_of

NONE: frozenset[str] = frozenset()


def encode(steps: tuple[wire_plan.Step, ...], tables: Tables, indent: int) -> list[str]:
    """Return the lines that write a message; what they use is defined in `tables`."""
    encoder = _Encoder(tables, Position(Alignment()))
    encoder.field("4s", 1, 4, tables.function("encapsulation", "HEADERS[order]"))
    for step in steps:
        encoder.step(step)
    encoder.flush(1)
    body = statements.prune(tuple(encoder.body), NONE)
    return statements.function(body, indent, tuple(encoder.again))


class _Encoder(Framing):
    """Emits a message's steps."""

    def __init__(self, tables: Tables, here: Position) -> None:
        super().__init__(tables, here)
        #: What is true if another thread changed the length of an array that was not copied.
        self.again: list[str] = []
        self.looping = False

    def step(self, step: wire_plan.Step) -> None:
        """Emit one step."""
        match step:
            case wire_plan.Block() if step.is_large:
                self.block(step)
            case wire_plan.Number() | wire_plan.Dummy() | wire_plan.Block():
                self.fixed(step)
            case wire_plan.Enter(place):
                if not step.empty:
                    self.line(place.text, place.local)
            case wire_plan.Text(place, wide):
                if wide:
                    writer = self.tables.function("wide_text", "wide_text(order)")
                    self.buffer(place, call(writer, place.text), 4)
                else:
                    self.text(place)
            case wire_plan.Bytes(place, primitive, bound):
                function = wire_plan.LIST_PRIMITIVES[primitive]
                writer = self.tables.function(function, function)
                self.buffer(place, call(writer, place.text), 1, bound)
            case wire_plan.Numbers():
                self.numbers(step)
            case wire_plan.Texts():
                self.texts(step)
            case wire_plan.Items():
                self.items(step)

    # Values of variable or large size are parts of their own.

    def block(self, step: wire_plan.Block) -> None:
        """Emit a large array of fixed size."""
        self.flush(step.unit)
        self.pad(step.unit)
        self.put(call(self.tables.buffer_writer(step), step.place.text))
        self.here.advance(step.size)
        self.settle()

    def check(self, condition: str, problem: str) -> None:
        """Emit a check; `validate` finds the field and the words afterwards."""
        raised = statements.Line(f'raise ValueError("{problem}")')
        self.body.append(statements.Block(f"if {condition}:", (raised,)))

    def bound(self, count: str, bound: int | None) -> None:
        """Check a sequence's upper limit."""
        if bound is not None:
            self.check(f"{count} > {bound}", "too many elements")

    def buffer(
        self, place: wire_plan.Place, value: Node, unit: int, bound: int | None = None
    ) -> None:
        """Emit the count of a buffer's units, and the buffer."""
        local = place.local
        self.line(value, local)
        self.bound(f"len({local})", bound)
        count = f"len({local})" if unit == 1 else f"len({local}) // {unit}"
        self.field("I", 4, 4, count)
        self.flush(1)
        self.put(local)
        self.here.skip(f"len({local})", unit)
        self.settle()

    def numbers(self, step: wire_plan.Numbers) -> None:
        """Emit a numeric sequence."""
        local = step.place.local
        count = self.tables.local(f"{local}_count")
        if self.looping:
            self.line(call(self.tables.sequence_copier(step), step.place.text), local)
            self.line(f"len({local})" + (f" // {step.unit}" if step.unit > 1 else ""), count)
        else:
            self.line(step.place.text, local)
            converted = statements.Line(call(self.tables.sequence_writer(step), local), local)
            array = self.tables.function("array", "array_of(order)")
            self.body.append(statements.Block(f"if type({local}) is not {array}:", (converted,)))
            self.line(f"len({local})", count)
            self.again.append(f"len({local}) != {count}")
        self.bound(count, step.bound)
        self.field("I", 4, 4, count)
        self.flush(1)
        repeat = wire_plan.Fixed(step.unit, step.unit, step.unit)
        self.elements(local, count, repeat, unless=count)

    def texts(self, step: wire_plan.Texts) -> None:
        """Emit an array or sequence of strings, its count included."""
        local = step.place.local
        self.flush(4)
        self.pad(4)
        self.line(call(self.tables.texts_writer(step), step.place.text), local)
        self.put(local)
        self.here.skip(f"len({local})", 4 if step.wide else 1)
        self.settle()

    def count(self, step: wire_plan.Items, count: str) -> None:
        """Emit the check of a size, or the count."""
        self.bound(count, step.bound)
        if step.size is None:
            self.field("I", 4, 4, count)
        else:
            self.check(f"{count} != {step.size}", "wrong number of elements")

    def rows(self, step: wire_plan.Items) -> None:
        """Emit structures of strings: what goes around each is looked up, all is encoded once."""
        local = step.place.local
        rows, block = self.tables.local(f"{local}_rows"), self.tables.local(f"{local}_block")
        sized = self.tables.function("sized", "sizes(order)")
        ended = self.tables.function("ended", "ENDS")
        places = [part.place for part in step.body if isinstance(part, wire_plan.Text)]
        parts = [
            part
            for one in places
            for part in (f"{sized}[len({one.local})]", one.local, f"{ended}[len({one.local})]")
        ]
        lines = [statements.Line(one.text, one.local) for one in places]
        lines.append(statements.Line(tuple_of(*parts), rows, "+="))
        loop = f"for {step.item} in {local}"
        given = tuple_of(*(one.text for one in places))
        each = self.tables.local("each")
        texts = Comprehension(each, ((step.item, local), (each, given)))
        unsized = call(self.tables.function("unsized", "unsized"), texts)
        self.line(step.place.text, local)
        self.line("[]", f"{rows}: list[str]")
        attempt = statements.Block("try:", (statements.Block(f"{loop}:", tuple(lines)),))
        instead = statements.Block("except IndexError:", (statements.Line(unsized, rows),))
        self.body.append(statements.Block(f"if len({local}):", (attempt, instead)))
        self.count(step, f"len({rows}) // {len(parts)}")
        self.flush(4)
        self.pad(4)
        self.line(call(self.tables.function("write_rows", "rows_writer(order)"), rows), block)
        self.put(block)
        self.here.skip(f"len({block})", 1)
        self.settle()

    def items(self, step: wire_plan.Items) -> None:
        """Emit an array or sequence of structures, as many as there are at one moment."""
        repeat = wire_plan.fixed(step.body)
        only_texts = all(isinstance(part, wire_plan.Text) and not part.wide for part in step.body)
        if only_texts and wire_plan.is_many(step):
            self.rows(step)
            return
        local = step.place.local
        self.line(call(self.tables.function("listed", "listed"), step.place.text), local)
        self.count(step, f"len({local})")
        if repeat is None:
            self.loop(step)
        else:
            self.fused(step, repeat)

    def fused(self, step: wire_plan.Items, repeat: wire_plan.Fixed) -> None:
        """Emit structures of constant size: one Struct, one join."""
        local = step.place.local
        self.flush(1 if step.size is None else repeat.align)
        inner = _Encoder(self.tables, Position(Alignment(8, 4)))
        for part in inlined(step):
            inner.fixed(part)
        writer = self.tables.writer("".join(inner.frame.fields), False, 4, 1)
        row = Group(writer, tuple(inner.frame.values))
        block = self.tables.local(f"{local}_block")
        gap = "\\x00" * (repeat.stride - repeat.size)
        blocks = Comprehension(row, ((step.item, local),))
        self.line(Group(f'b"{gap}".join', (blocks,)), block)
        self.elements(block, f"len({local})", repeat, unless=local if step.size is None else "")

    def elements(self, part: str, count: str, repeat: wire_plan.Fixed, *, unless: str) -> None:
        """Emit elements of constant size; no padding goes before if `unless` is false."""
        gap = repeat.stride - repeat.size
        size = count if repeat.stride == 1 else f"{repeat.stride} * {count}"
        size += f" - {gap}" if gap else ""
        modulus = power_of_two(repeat.size, repeat.stride)
        if not unless or (self.here.known.is_at(repeat.align) and not gap):
            self.pad(repeat.align)
            self.put(part)
            self.here.skip(size, modulus)
        else:
            self.settle()
            if self.here.constant:
                self.note("at", self.here.text)
            self.note("low", self.here.low)
            self.pad(repeat.align, unless)
            self.put(part)
            with self.within(f"if {unless}:"):
                start = aligned_to_8("at") if repeat.align == 8 else "at"
                self.note("at", f"{start} + {size}")
                self.note("low", size)
            self.here = Position.variable(multiple_of(4).modulo(modulus))
        self.settle()

    def loop(self, step: wire_plan.Items) -> None:
        """Emit structures one by one."""
        self.flush(1)
        entry = self.here
        if entry.constant:
            self.note("at", entry.text)
        if entry.known.knows(4):
            self.note("low", entry.low)
        head = entry.known
        looping, self.looping = self.looping, True
        while True:
            mark = self.tables.mark()
            with self.within(f"for {step.item} in {step.place.local}:"):
                self.here = Position.variable(head)
                self.frame = Frame(self.here)
                for part in step.body:
                    self.step(part)
                self.flush(1)
                end = self.here
                if end.known.knows(4) and not head.knows(4):
                    self.note("low", end.low)
            met = head.meet(end.known)
            if met == head:
                break
            head = met
            self.tables.reset(mark)
            self.body.pop()
        self.looping = looping
        self.here = Position.variable(head)
        self.frame = Frame(self.here)


def power_of_two(*sizes: int) -> int:
    """Return the largest power of two, up to 8, that divides all sizes."""
    return min(size & -size for size in (*sizes, 8))


def inlined(step: wire_plan.Items) -> list[wire_plan.Step]:
    """Return an element's fixed-size steps, with attribute chains instead of variables."""
    paths = {step.item: step.item}
    found: list[wire_plan.Step] = []
    for part in step.body:
        match part:
            case wire_plan.Enter(place):
                paths[place.local] = f"{paths[place.owner]}.{place.slot}"
            case wire_plan.Number(place, letter, size):
                moved = msgspec.structs.replace(place, owner=paths[place.owner])
                found.append(wire_plan.Number(moved, letter, size))
            case wire_plan.Block(place, primitive, count):
                moved = msgspec.structs.replace(place, owner=paths[place.owner])
                found.append(wire_plan.Block(moved, primitive, count))
            case _:
                found.append(part)
    return found
