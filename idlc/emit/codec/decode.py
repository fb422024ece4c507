"""From a layout to the statements that read it.

Numbers that follow each other are read by one precompiled Struct. A Struct and an index check
their own bounds; a slice that ends after the buffer's end is shorter, and whatever is read next,
or a check at the end, fails. Before structures are made, their least size is compared with the
bytes that are left: nothing is allocated that the buffer does not hold. Any failure is explained
afterwards, by the runtime.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from idlc.emit.codec import wire_plan
from idlc.emit.codec.alignment import multiple_of
from idlc.emit.codec.constants import Tables
from idlc.emit.codec.cursor import Cursor
from idlc.emit.codec.runs import Run, Running, slice_of
from idlc.emit.codec.statements import Block, Line, Statement
from idlc.emit.python_lines import Comprehension, Node, call, tuple_of
from idlc.model import ir

UNENDED = (Line('raise ValueError("text without end")'),)


def is_bulk(steps: tuple[wire_plan.Step, ...]) -> bool:
    """Return whether a structure holds numeric buffers, which are read through a memoryview."""
    return any(
        isinstance(step, wire_plan.Numbers)
        or (isinstance(step, wire_plan.Block) and step.is_large)
        or (isinstance(step, wire_plan.Items) and is_bulk(step.body))
        for step in steps
    )


def decode(
    steps: tuple[wire_plan.Step, ...],
    tables: Tables,
    own: str,
    makers: dict[ir.TypeName, str],
    foreign: Mapping[ir.TypeName, str],
    *,
    bulk: bool,
) -> tuple[Statement, ...]:
    """Return the statements that read a message; what they use is defined in `tables`.

    `own` and `makers` name the functions that make empty objects, `foreign` the classes of other
    packages; `bulk` is what `is_bulk` says.
    """
    decoder = _Decoder(tables, makers, foreign, "view" if bulk else "data")
    decoder.line(f"{own}()", "message")
    for step in steps:
        decoder.step(step)
    decoder.flush(last=True)
    decoder.finish()
    first = []
    if decoder.limited or decoder.source == "view":
        first.append(Line("len(data)", "limit"))
    if decoder.source == "view":
        first.append(Line(f"data if limit < {tables.small()} else memoryview(data)", "view"))
    return (*first, *decoder.body, Line("return message"))


class _Decoder(Running):
    """Emits a message's steps; `makers` name the functions that make empty objects."""

    def __init__(
        self,
        tables: Tables,
        makers: dict[ir.TypeName, str],
        foreign: Mapping[ir.TypeName, str],
        source: str,
    ) -> None:
        super().__init__(tables, source)
        self.makers = makers
        self.foreign = foreign
        self.looping = False

    def step(self, step: wire_plan.Step) -> None:
        """Emit one step."""
        match step:
            case wire_plan.Block() if step.is_large:
                self.block(step)
            case wire_plan.Number() | wire_plan.Dummy() | wire_plan.Block():
                self.fixed(step, self.run)
            case wire_plan.Enter(place, type_):
                self.body += self.enter(place, type_)
            case wire_plan.Text(place, wide):
                self.line(self.wide_text() if wide else self.text(), place.text)
            case wire_plan.Bytes(place, primitive, bound):
                name = f"read_{wire_plan.LIST_PRIMITIVES[primitive]}"
                raw = self.buffer(self.count(bound), 1, 1, self.source)
                self.line(call(self.tables.function(name, name), raw), place.text)
            case wire_plan.Numbers():
                self.numbers(step)
            case wire_plan.Texts():
                self.texts(step)
            case wire_plan.Items():
                self.items(step)

    # Values of fixed size.

    def fixed(self, step: wire_plan.Step, run: Run) -> None:
        """Add a value to a run."""
        match step:
            case wire_plan.Number(place, letter, size):
                run.add(letter, size, size, place.text)
            case wire_plan.Block(place):
                run.add(step.token, step.unit, step.size, place.local)
                reader = self.tables.block_reader(step)
                run.after.append(Line(call(reader, place.local), place.text))
            case _:
                run.add("x", 1, 1)

    def enter(self, place: wire_plan.Place, type_: ir.TypeName) -> tuple[Statement, ...]:
        """Return the statements that make a nested object."""
        return (Line(f"{self.makers[type_]}()", place.local), Line(place.local, place.text))

    # Values of variable size.

    def text(self) -> Node:
        """Read the size of a string; return the expression that reads the string.

        The last byte must be zero; to look at it is to check the bounds.
        """
        size = "size"
        if self.worded and not self.run.fields:
            self.align(4)
            self.here = self.here.skip(4)
            start = self.start()
            size = f"words[{start} >> 2]"
        else:
            self.number(size)
            start = self.start()
        self.line(f"{self.here.text(-1)} + {size}", "end")
        self.body.append(Block("if data[end]:", UNENDED))
        self.here = Cursor("end", 1, multiple_of(1))
        if self.worded:
            return call("to_str", f"chars{slice_of(start)}")
        return call(self.tables.text(), f"data{slice_of(start)}")

    def wide_text(self) -> Node:
        """Read the size of a wstring; return the expression that reads the wstring."""
        self.number("count")
        raw = self.buffer("count", 4, 4, "data")
        return call(self.tables.function("read_wide_text", "read_wide_text(order)"), raw)

    def numbers(self, step: wire_plan.Numbers) -> None:
        """Read a numeric sequence as one buffer."""
        raw = self.buffer(self.count(step.bound), step.unit, step.unit, "view")
        kind = self.foreign.get(step.place.type)
        reading = f"reading.of({kind})" if kind else "reading"
        self.line(call(self.tables.sequence_reader(step, reading), raw), step.place.text)

    def block(self, step: wire_plan.Block) -> None:
        """Read a large array of fixed size as one buffer."""
        self.flush()
        self.align(step.unit)
        start, end = self.here.text(), self.here.text(step.size)
        self.short_if(f"{end} > limit")
        self.here = self.here.skip(step.size)
        reader = self.tables.block_reader(step)
        self.line(call(reader, f"{self.source}{slice_of(start, end)}"), step.place.text)

    def begin(self, step: wire_plan.Texts | wire_plan.Items) -> str:
        """Read the count, or return the size."""
        if step.size is None:
            return self.count(step.bound)
        self.flush()
        return str(step.size)

    def texts(self, step: wire_plan.Texts) -> None:
        """Read an array or sequence of strings."""
        count = self.begin(step)
        self.align(4)
        reader = self.tables.texts_reader(step)
        texts = call(reader, "data", self.here.text(), count)
        self.line(texts, tuple_of(step.place.text, "end"))
        self.here = Cursor("end", 0, multiple_of(4 if step.wide else 1))

    def items(self, step: wire_plan.Items) -> None:
        """Read an array or sequence of structures."""
        repeat = wire_plan.fixed(step.body)
        if repeat is not None and repeat.stride == repeat.size:
            self.rows(step, repeat)
            return

        def element() -> None:
            for part in step.body:
                self.step(part)
            self.flush()

        count = self.begin(step)
        least = wire_plan.smallest(step.body)
        if step.size is None:
            wanted = count if least == 1 else f"{least} * {count}"
            self.short_if(f"{self.here.text()} + {wanted} > limit")
        else:
            self.short_if(f"{self.here.text(least * step.size)} > limit")
        empty = Comprehension(f"{self.makers[step.type]}()", (("_", f"range({count})"),))
        self.line(empty, step.place.local)
        self.line(step.place.local, step.place.text)
        worded = self.worded
        many = wire_plan.is_many(step) and wire_plan.is_text(step.body)
        # not within a loop: it goes over all that follows
        if many and not worded and self.source == "data" and not self.looping:
            strings = call(self.tables.strings(), "data", self.here.text())
            self.line(strings, tuple_of("words", "chars", "to_str"))
            self.worded = True
        self.loop(f"for {step.item} in {step.place.local}:", element)
        self.worded = worded

    def rows(self, step: wire_plan.Items, repeat: wire_plan.Fixed) -> None:
        """Read structures of constant size: one Struct yields the values of each."""
        count = self.begin(step)
        self.line("[]", f"{step.place.local}: list[_idlc.Any]")
        self.line(step.place.local, step.place.text)
        if step.size is not None:
            self.align(repeat.align)
        run = Run()
        entered: list[Statement] = []
        for part in step.body:
            if isinstance(part, wire_plan.Enter):
                entered += self.enter(part.place, part.type)
            else:
                self.fixed(part, run)
        reader = self.tables.rows("".join(run.fields))
        values = self.tables.local(f"{step.item}_values") if run.targets else "_"
        rows = self.buffer(count, repeat.align, repeat.size, self.source)
        stored = [Line(values, tuple_of(*run.targets))] if run.targets else []
        body = (
            Line(f"{self.makers[step.type]}()", step.item),
            Line(call(f"{step.place.local}.append", step.item)),
            *entered,
            *stored,
            *run.after,
        )
        self.body.append(Block(f"for {values} in {reader}({rows}):", body))

    def loop(self, head: str, emit: Callable[[], None]) -> None:
        """Emit a loop; `emit` emits its body, until what is known of the position holds.

        Between two rounds the position is in `at`, or in `end` if the body ends with a string.
        """
        entry, first = self.here, self.here.at("at")
        unchecked = self.unchecked
        looping, self.looping = self.looping, True
        while True:
            mark = self.tables.mark()
            with self.within(head):
                self.here = first
                emit()
                again = first.where(first.known.meet(self.here.known))
                if first.base == "at" and self.here.base == "end":
                    again = again.at("end", self.here.offset)
                self.settle(again.base, again.offset)
            loop = self.body.pop()
            if again == first:
                break
            first = again
            self.tables.reset(mark)
        self.looping = looping
        self.here = entry
        self.settle(first.base, first.offset)
        self.body.append(loop)
        self.here = first
        self.unchecked |= unchecked
