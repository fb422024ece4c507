"""From a layout to the statements that read it.

Numbers that follow each other are read by one precompiled Struct. A Struct and an index check
their own bounds; a slice that ends after the buffer's end is shorter, and whatever is read next,
or a check at the end, fails. Before structures are made, their least size is compared with the
bytes that are left: nothing is allocated that the buffer does not hold. Any failure is explained
afterwards, by the runtime.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

from msgspec.structs import replace

from idlc.generate.python.statements import (
    Builder,
    CodeStatement,
    CompoundStatement,
    Comprehension,
    Cursor,
    Group,
    NamedExpressions,
    PlainStatement,
    ValueRun,
    call,
)
from idlc.model import ir
from idlc.model.names import snake_case
from idlc.wire import plan
from idlc.wire.layout import multiple_of

#: Functions or classes by the types that they are of.
Names: TypeAlias = Mapping[ir.TypeName, str]

TOO_SHORT = (PlainStatement('raise ValueError("too short")'),)
TOO_MANY = (PlainStatement('raise ValueError("too many elements")'),)
UNENDED = (PlainStatement('raise ValueError("text without end")'),)


class ReadRun(ValueRun):
    """Values with what follows them, and the alignment and size of each.

    `arrays` has the arrays of numbers, by their type and their index among the values.
    """

    def __init__(self) -> None:
        super().__init__()
        self.sizes: list[tuple[int, int]] = []
        self.after: list[CodeStatement] = []
        self.arrays: dict[str, dict[int, plan.NumberBlock]] = {}

    def skipped(self, cursor: Cursor) -> Cursor:
        """Return the position after the values, of which the first is at `cursor`."""
        for align, size in self.sizes:
            if not cursor.alignment.knows(align):
                cursor = cursor.with_alignment(multiple_of(align))
            cursor = cursor.aligned(align).skip(size)
        return cursor

    def assignment(self, value: str) -> PlainStatement:
        """Return the statement that reads the values."""
        return (
            PlainStatement(value, Group("", tuple(self.values)))
            if self.values
            else PlainStatement(value)
        )


def slice_of(start: str, end: str = "end") -> str:
    """Return the slice from one expression to another."""
    if " " in start + end:
        return f"[{start} : {end}]"
    return f"[{start}:{end}]"


def is_bulk(steps: tuple[plan.Step, ...]) -> bool:
    """Return whether a structure holds numeric buffers, of which a memoryview saves a copy."""
    return any(
        isinstance(step, plan.NumbersStep) or (isinstance(step, plan.NumberBlock) and step.is_large)
        for step in plan.walk(steps)
    )


def decode(
    steps: tuple[plan.Step, ...], tables: NamedExpressions, own: str, makers: Names, foreign: Names
) -> tuple[CodeStatement, ...]:
    """Return the statements that read a message; what they use is defined in `tables`.

    `own` and `makers` name the functions that make empty objects, `foreign` the classes of other
    packages.
    """
    decoder = Decoder(tables, makers, foreign, is_bulk(steps))
    decoder.line(f"{own}()", "message")
    for step in steps:
        decoder.step(step)
    decoder.flush(last=True)
    if decoder.unchecked:
        decoder.short_if(f"{decoder.position.text()} > limit")
    first = (PlainStatement("len(data)", "limit"),) if decoder.limited else ()
    return (*first, *decoder.body, PlainStatement("return message"))


class Decoder(Builder):
    """Emits statements that read; `run` is not yet emitted, `position` is before it.

    `bulk`: there are numeric buffers. `limited`: a check needs the buffer's size. `unchecked`: no
    statement has noticed yet that a buffer was cut short. `worded`: the sizes of strings are in
    `words` and their text in `chars`.
    """

    def __init__(self, tables: NamedExpressions, makers: Names, foreign: Names, bulk: bool) -> None:
        super().__init__(tables, Cursor("", 4, multiple_of(8)))
        self.makers = makers
        self.foreign = foreign
        self.bulk = bulk
        self.run = ReadRun()
        self.limited = False
        self.unchecked = False
        self.worded = False

    def flush(self, *, last: bool = False) -> None:
        """Emit the run; the position after the `last` one is not needed."""
        run, self.run = self.run, ReadRun()
        if not run.fields:
            return
        self.unchecked = False
        if run.sizes[0][0] == run.widest:
            self.align(run.widest)
        offset = self.position.text()
        known = self.position.alignment.knows(run.widest)
        self.make_arrays(run, self.position if known else None)
        if self.worded and run.fields == ["I"]:
            self.line(f"words[{self.position.text(4)} >> 2]", run.values[0])
            self.position = run.skipped(self.position)
        elif known:
            reader = self.reader(run, self.position.alignment.residue)
            self.body.append(run.assignment(call(reader, "data", offset)))
            self.position = run.skipped(self.position)
        else:
            table = f"{self.reader(run, None)}[{offset} & 7]"
            struct = table if last else "struct"
            if not last:
                self.line(table, struct)
            self.body.append(run.assignment(call(f"{struct}.unpack_from", "data", offset)))
            if not last:
                self.line(f"{offset} + struct.size", "at")
                self.position = run.skipped(self.position).at("at")
        self.body += run.after

    def reader(self, run: ValueRun, start: int | None) -> str:
        """Return the function that reads a run, or without `start` a table of Structs."""
        return self.tables.struct("read", run.path, run.fields, start, "unpack_from")

    def align(self, align: int) -> None:
        """Go to the next multiple of `align`, counted from the end of the header."""
        # from one size to the next, words are found by what comes after
        lead = 4 if self.worded and align == 4 else 0
        self.position = self.position.skip(lead).aligned(align)
        if self.position.masked:
            self.store_position("at")
        self.position = self.position.skip(-lead)

    def number(self, target: str, path: str) -> None:
        """Read a count or size into a variable, together with the numbers before it."""
        self.run.add("I", 4, target, path)
        self.run.sizes.append((4, 4))
        self.flush()

    def count(self, bound: int | None, path: str) -> str:
        """Read the count of a sequence and check its upper limit."""
        self.number("count", path)
        if bound is not None:
            self.body.append(CompoundStatement(f"if count > {bound}:", TOO_MANY))
        return "count"

    def start(self) -> str:
        """Return the position as an expression that stays true when `end` changes."""
        if self.position.base == "end":
            self.store_position("at")
        return self.position.text()

    def buffer(self, count: str, align: int, size: int) -> str:
        """Return the slice of `count` elements, and move after it.

        It is shorter if the buffer is, which whatever is read next notices.
        """
        start = self.pass_elements(count, align, size)
        self.unchecked = True
        return f"data{slice_of(start)}"

    def pass_elements(self, count: str, align: int, size: int) -> str:
        """Move after `count` elements, and return the position of the first."""
        if not self.position.alignment.is_at(align):
            self.store_position("at")
            self.body.append(
                CompoundStatement(f"if {count}:", (PlainStatement("(at + 3 & -8) + 4", "at"),))
            )
            self.position = self.position.with_alignment(multiple_of(4))
        start = self.start()
        self.line(f"{start} + {count}" if size == 1 else f"{start} + {size} * {count}", "end")
        self.position = Cursor("end", 0, self.position.alignment.modulo(size & -size))
        return start

    def short_if(self, condition: str) -> None:
        """Emit a check that the buffer is long enough."""
        self.limited = True
        self.body.append(CompoundStatement(f"if {condition}:", TOO_SHORT))

    def step(self, step: plan.Step) -> None:
        """Emit one step."""
        match step:
            case plan.NumberBlock() if step.is_large:
                self.block(step)
            case plan.Number() | plan.Dummy() | plan.NumberBlock():
                self.fixed(step, self.run)
            case plan.Enter(place, type_):
                self.body += self.make_nested(place, type_)
            case plan.StringStep(place, wide):
                self.line(self.wide_text(place) if wide else self.text(place), place.text)
            case plan.Bytes(place, primitive, bound):
                raw = self.buffer(self.count(bound, place.path), 1, 1)
                self.line(call(self.list_reader(primitive), raw), place.text)
            case plan.NumbersStep():
                self.numbers(step)
            case plan.StringsStep():
                self.texts(step)
            case plan.StructuresStep():
                self.items(step)

    # Values of fixed size.

    def fixed(self, step: plan.Plain, run: ReadRun) -> None:
        """Add a value to a run."""
        if isinstance(step, plan.Dummy):
            run.add(step.code, 1, "", "nothing")
        elif isinstance(step, plan.Number):
            run.add(step.code, step.unit, step.place.text, step.place.path)
        else:
            run.add(step.code, step.unit, step.place.local, step.place.path)
            run.arrays.setdefault(step.primitive, {})[len(run.sizes)] = step
        run.sizes.append((step.unit, step.size))

    def make_arrays(self, run: ReadRun, position: Cursor | None = None) -> None:
        """Make arrays of the bytes of a run, those of one type as parts of one.

        A slice of an array takes less time than an array. The Struct, which goes over their bytes,
        checks that the buffer has them. Without its position, each is made of its own bytes.
        """
        for primitive, arrays in run.arrays.items():
            if position is None or len(arrays) < 2 or primitive in plan.LIST_PRIMITIVES:
                for step in arrays.values():
                    made = call(self.block_reader(step), step.place.local)
                    run.after.append(PlainStatement(made, step.place.text))
                continue
            cursor, starts = position, {}
            for index, (align, size) in enumerate(run.sizes):
                start = cursor.aligned(align)
                if index in arrays:
                    starts[index] = start
                    run.fields[index] = f"{start.offset - cursor.offset + size}x"
                cursor = start.skip(size)
            first, last, unit = min(arrays), max(arrays), arrays[min(arrays)].unit
            begin, end = starts[first], starts[last].skip(arrays[last].size)
            whole = replace(arrays[first], count=(end.offset - begin.offset) // unit)
            numbers = self.tables.local("numbers")
            made = call(self.block_reader(whole), "data", begin.text())
            run.after.append(PlainStatement(made, numbers))
            for index, step in arrays.items():
                run.values.remove(step.place.local)
                at = (starts[index].offset - begin.offset) // unit
                part = f"{numbers}[{at}:{at + step.count}]"
                run.after.append(PlainStatement(part, step.place.text))

    def block_reader(self, step: plan.NumberBlock) -> str:
        """Return the function that turns bytes into a fixed-size array."""
        if step.primitive in plan.LIST_PRIMITIVES:
            return self.list_reader(step.primitive)
        return self.tables.array("array_of", "array_reader", step, "reading")

    def list_reader(self, primitive: str) -> str:
        """Return the function that turns bytes into a list of bools or bytes."""
        kind = plan.LIST_PRIMITIVES[primitive]
        return self.tables.function(f"list_of_{kind}", f"read_{kind}")

    def make_nested(self, place: plan.Slot, type_: ir.TypeName) -> tuple[CodeStatement, ...]:
        """Return the statements that make a nested object."""
        return (
            PlainStatement(f"{self.makers[type_]}()", place.local),
            PlainStatement(place.local, place.text),
        )

    # Values of variable size.

    def text(self, place: plan.Slot) -> str:
        """Read the size of a string; return the expression that reads the string.

        The last byte must be zero; reading it checks the bounds.
        """
        size = "size"
        if self.worded and not self.run.fields:
            self.align(4)
            self.position = self.position.skip(4)
            start = self.start()
            size = f"words[{start} >> 2]"
        else:
            self.number(size, place.path)
            start = self.start()
        self.line(f"{self.position.text(-1)} + {size}", "end")
        self.body.append(CompoundStatement("if data[end]:", UNENDED))
        self.position = Cursor("end", 1, multiple_of(1))
        if self.worded:
            return call("to_str", f"chars{slice_of(start)}")
        return call(self.tables.define("text", "reading.text"), f"data{slice_of(start)}")

    def wide_text(self, place: plan.Slot) -> str:
        """Read the size of a wstring; return the expression that reads the wstring."""
        self.number("count", place.path)
        raw = self.buffer("count", 4, 4)
        return call(self.tables.function("read_wide_text", "read_wide_text(order)"), raw)

    def numbers(self, step: plan.NumbersStep) -> None:
        """Read a numeric sequence as one buffer."""
        count = self.count(step.bound, step.place.path)
        start = self.pass_elements(count, step.unit, step.unit)
        self.unchecked = True
        name, reading = step.info.dtype, "reading"
        if foreign := self.foreign.get(step.place.type):  # the class that holds it
            name, reading = f"{name}_of_{snake_case(foreign)}", f"reading.of({foreign})"
        arguments = ("order", f'"{step.info.code}"', reading)
        reader = self.tables.function(f"sequence_of_{name}", call("sequence_reader", *arguments))
        element = self.tables.function(name, call("element_type", *arguments))
        self.line(call(reader, "data", element, count, start), step.place.text)

    def block(self, step: plan.NumberBlock) -> None:
        """Read a large array of fixed size as one buffer."""
        self.flush()
        self.align(step.unit)
        start = self.position
        self.position = start.skip(step.size)
        self.short_if(f"{self.position.text()} > limit")
        if step.primitive in plan.LIST_PRIMITIVES:
            raw = f"data{slice_of(start.text(), self.position.text())}"
            made = call(self.block_reader(step), raw)
        else:
            made = call(self.block_reader(step), "data", start.text())
        self.line(made, step.place.text)

    def begin(self, step: plan.StringsStep | plan.StructuresStep) -> str:
        """Read the count, or return the size."""
        if step.size is None:
            return self.count(step.bound, step.place.path)
        self.flush()
        return str(step.size)

    def texts(self, step: plan.StringsStep) -> None:
        """Read an array or sequence of strings."""
        count = self.begin(step)
        self.align(4)
        if step.wide:
            function = "wide_texts_reader(order)"
        else:
            function = call("texts_reader", "order", self.tables.define("text", "reading.text"))
        reader = self.tables.function(f"read_{step.place.path}", function)
        texts = call(reader, "data", self.position.text(), count)
        self.line(texts, f"{step.place.text}, end")
        self.position = Cursor("end", 0, multiple_of(4 if step.wide else 1))

    def items(self, step: plan.StructuresStep) -> None:
        """Read an array or sequence of structures."""
        repeat = plan.fixed(step.body)
        if repeat is not None and repeat.stride == repeat.size:
            self.rows(step, repeat)
            return

        def element() -> None:
            for part in step.body:
                self.step(part)
            self.flush()

        count = self.begin(step)
        least = plan.smallest(step.body)
        if step.size is None:
            needed = count if least == 1 else f"{least} * {count}"
            self.short_if(f"{self.position.text()} + {needed} > limit")
        else:
            self.short_if(f"{self.position.text(least * step.size)} > limit")
        empty = Comprehension(f"{self.makers[step.type]}()", (f"for _ in range({count})",))
        self.line(empty, step.place.local)
        self.line(step.place.local, step.place.text)
        worded = self.worded
        many = plan.is_many(step) and plan.is_text(step.body)
        # not within a loop: it goes over all that follows
        if many and not (worded or self.bulk or self.looping):
            strings = self.tables.function("strings", "strings_reader(order, reading.text)")
            self.line(call(strings, "data", self.position.text()), "words, chars, to_str")
            self.worded = True
        unchecked = self.unchecked
        self.loop(f"for {step.item} in {step.place.local}:", element)
        self.unchecked |= unchecked  # there may be no element
        self.worded = worded

    def rows(self, step: plan.StructuresStep, repeat: plan.Fixed) -> None:
        """Read structures of constant size: one Struct yields the values of each."""
        count = self.begin(step)
        self.line("[]", f"{step.place.local}: list[Any]")
        self.line(step.place.local, step.place.text)
        if step.size is not None:
            self.align(repeat.align)
        run = ReadRun()
        entered: list[CodeStatement] = []
        for part in step.body:
            if isinstance(part, plan.Enter):
                entered += self.make_nested(part.place, part.type)
            elif isinstance(part, (plan.Number, plan.Dummy, plan.NumberBlock)):
                self.fixed(part, run)
        self.make_arrays(run)
        reader = self.tables.struct("read", step.item, run.fields, 4, "iter_unpack")
        values = self.tables.local(f"{step.item}_values") if run.values else "_"
        rows = self.buffer(count, repeat.align, repeat.size)
        stored = [run.assignment(values)] if run.values else []
        body = (
            PlainStatement(f"{self.makers[step.type]}()", step.item),
            PlainStatement(call(f"{step.place.local}.append", step.item)),
            *entered,
            *stored,
            *run.after,
        )
        self.body.append(CompoundStatement(f"for {values} in {reader}({rows}):", body))
