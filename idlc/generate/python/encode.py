"""From a layout to the statements that write it.

Numbers that follow each other are written by one precompiled Struct; so is a string between
them, by one Struct for each of its sizes. Positions modulo 8 are followed as far as they are
known, so that padding is part of the Structs. After a string or a sequence of unknown size,
the statement picks the Struct by the position, which is noted in `at` only where a later
statement reads it.
"""

from __future__ import annotations

from itertools import accumulate

from msgspec.structs import replace

from idlc.generate.python.statements import (
    Builder,
    CodeStatement,
    CompoundStatement,
    Comprehension,
    Cursor,
    Expression,
    Group,
    NamedExpressions,
    Note,
    PlainStatement,
    Put,
    ValueRun,
    call,
    flat,
)
from idlc.wire import plan
from idlc.wire.layout import Alignment, multiple_of


def encode(steps: tuple[plan.Step, ...], tables: NamedExpressions) -> tuple[CodeStatement, ...]:
    """Return the statements that write a message; what they use is defined in `tables`."""
    encoder = _Encoder(tables, Alignment(), 8)
    encoder.field("4s", 1, 4, tables.function("encapsulation", "HEADERS[order]"), "head")
    widths = [*accumulate((plan.widest((step,)) for step in reversed(steps)), max)]
    for step in steps:
        encoder.widest = widths.pop()
        encoder.step(step)
    encoder.flush(1)
    return _joined(_pruned(tuple(encoder.body), live=False)[0], tuple(encoder.again))


def _pruned(
    body: tuple[CodeStatement, ...], *, live: bool
) -> tuple[tuple[CodeStatement, ...], bool]:
    """Return the statements without the notes that nothing reads, and whether they read `at`.

    `live`: it is read afterwards.
    """
    kept: list[CodeStatement] = []
    for statement in reversed(body):
        match statement:
            case Note(_, reads):
                if not live:
                    continue
                live = reads
            case Put(_, reads):
                live |= reads
            case CompoundStatement(head, inner):
                remaining, before = _pruned(inner, live=live)
                if before and not live:  # one round of a loop reads what another notes
                    live = True
                    remaining, _ = _pruned(inner, live=True)
                if not remaining:
                    continue
                statement = CompoundStatement(head, remaining)
            case PlainStatement():
                pass
        kept.append(statement)
    return tuple(reversed(kept)), live


def _interferes(statement: CodeStatement, waiting: list[Put]) -> bool:
    """Return whether a statement must not run before the parts that wait to be put."""
    match statement:
        case Note():
            return any(put.reads for put in waiting)
        case CompoundStatement(_, inner):
            return any(isinstance(s, Put) or _interferes(s, waiting) for s in inner)
        case _:
            return False


def _joined(body: tuple[CodeStatement, ...], again: tuple[str, ...]) -> tuple[CodeStatement, ...]:
    """Return the statements of a function that returns the result of `join` for the parts.

    Parts are collected as long as no position that they read changes. If one of the conditions
    of `again` is true in the end, the function begins anew.
    """
    result: list[CodeStatement] = []
    waiting: list[Put] = []
    begun = False
    for statement in body:
        if isinstance(statement, Put):
            waiting.append(statement)
            continue
        if _interferes(statement, waiting):
            result += waiting if begun else [PlainStatement(_listed(waiting), "parts"), _BEGUN]
            waiting, begun = [], True
        result.append(statement)
    if not begun and not again:
        return (*result, PlainStatement(Group("return join", (_listed(waiting),))))
    result += waiting if begun else [PlainStatement(_listed(waiting), "parts")]
    if not again:
        return (*result, PlainStatement("return join(parts)"))
    once_more = (PlainStatement("return encode(message, join)"),)
    blocks = [CompoundStatement(f"if {condition}:", once_more) for condition in again]
    return (*result, PlainStatement("join(parts)", "raw"), *blocks, PlainStatement("return raw"))


def _listed(parts: list[Put]) -> Group:
    return Group("", tuple(put.part for put in parts), brackets="[]")


_BEGUN = PlainStatement("parts.append", "put")


class _Encoder(Builder):
    """Emits statements that write; `run` is not yet emitted, `position` is after it.

    Positions matter modulo `widest` only, the widest alignment of this step and those after it.
    """

    def __init__(self, tables: NamedExpressions, alignment: Alignment, widest: int) -> None:
        super().__init__(tables, Cursor("", alignment.residue, alignment))
        self.widest = widest
        #: Conditions that hold if another thread changed the length of an uncopied array.
        self.again: list[str] = []
        self.run, self.start, self.text_size = ValueRun(), alignment, ""

    def step(self, step: plan.Step) -> None:
        """Emit one step."""
        match step:
            case plan.NumberBlock() if step.is_large:
                self.block(step)
            case plan.Number() | plan.Dummy() | plan.NumberBlock():
                self.fixed(step)
            case plan.Enter(place):
                if not step.empty:
                    self.line(place.text, place.local)
            case plan.StringStep(place, wide):
                if wide:
                    writer = self.tables.function("wide_text", "wide_text(order)")
                    self.buffer(place, call(writer, place.text), 4)
                else:
                    self.text(place)
            case plan.Bytes(place, primitive, bound):
                function = plan.LIST_PRIMITIVES[primitive]
                writer = self.tables.function(f"{function}_of", function)
                self.buffer(place, call(writer, place.text), 1, bound)
            case plan.NumbersStep():
                self.numbers(step)
            case plan.StringsStep():
                self.texts(step)
            case plan.StructuresStep():
                self.items(step)

    # Values of fixed size, and texts, are parts of a Struct.

    def fixed(self, step: plan.Plain) -> None:
        """Add a value of fixed size to the run."""
        path, value = "nothing", ""
        if not isinstance(step, plan.Dummy):
            path, value = step.place.path, step.place.text
        if step.code == "?":
            value = f"{self.tables.function('truths', 'TRUTHS')}[{value}]"
        elif isinstance(step, plan.NumberBlock):
            value = call(self.block_writer(step, "bytes_of", "array_writer"), value)
        self.field(step.code, step.unit, step.size, value, path)

    def block_writer(self, step: plan.NumberBlock, stem: str, function: str) -> str:
        """Return the function that turns a fixed-size array into bytes."""
        if step.primitive in plan.LIST_PRIMITIVES:
            kind = plan.LIST_PRIMITIVES[step.primitive]
            return self.tables.function(f"{kind}_{step.count}", f"{kind}_writer({step.count})")
        return self.tables.array(stem, function, step)

    def field(self, code: str, align: int, size: int, value: Expression, path: str) -> None:
        """Add a value to the run, which begins with it if it is empty."""
        if not self.run.fields:
            self.note_position()
            self.start = self.position.alignment
        self.run.add(code, align, value, path)
        self.position = self.position.aligned(align).skip(size)

    def text(self, place: plan.Slot) -> None:
        """Add a string to the run, which has at most one."""
        if "*" in self.run.fields:
            self.flush(4)
        size = self.text_size = self.tables.local(f"{place.path}_size")
        self.line(f"{place.text}.encode()", place.local)
        self.line(call("len", place.local), size)
        self.field("I", 4, 4, f"{size} + 1", place.path)
        self.run.add("*", 1, place.local, place.path)
        self.position = self.position.skip_by(size, 1).skip(1)

    def flush(self, align: int) -> None:
        """Emit the run, with the padding for a following `align` where that is known."""
        run, start = self.run, self.start
        if run.fields:
            if max(start.modulus, run.widest) < align:
                align = 1
            known = start.knows(max(run.widest, align))
            residue = start.residue if known else None
            key = "" if known else "[at & 7]"
            if "*" in run.fields:
                key += f"[{self.text_size}]"
            elif not known:
                key += ".pack"
            writer = self.tables.struct("write", run.path, run.fields, residue, "pack", align)
            self.body.append(Put(Group(f"{writer}{key}", tuple(run.values)), not known))
            self.position = self.position.aligned(align)
            self.run = ValueRun()

    def note_position(self) -> None:
        """Note the position in `at`, unless all that matters of it is known."""
        alignment = self.position.alignment
        if alignment.knows(self.widest):
            self.position = Cursor("", alignment.residue, alignment)
        else:
            self.store_position("at")

    # Values of variable or large size are parts of their own.

    def pad(self, align: int, unless_empty: str = "") -> None:
        """Emit padding as a part of its own."""
        alignment = self.position.alignment
        if alignment.is_at(align):
            return
        known = alignment.knows(align)
        if not known and not self.position.base.isidentifier():
            self.store_position("at")  # or the expression would grow with every field
        pad = self.tables.function(f"pad{align}", f"PAD{align}")
        part = f"{pad}[{alignment.residue if known else f'{self.position.text()} & 7'}]"
        part = f'{part} if {unless_empty} else b""' if unless_empty else part
        self.body.append(Put(part, self.position.reads and not known))
        if not unless_empty:
            self.position = self.position.aligned(align)

    def put(self, part: str, size: str, modulus: int) -> None:
        """Emit a part of `size` bytes, a multiple of `modulus`."""
        self.body.append(Put(part))
        self.position = self.position.skip_by(size, modulus)

    def block(self, step: plan.NumberBlock) -> None:
        """Emit a large array of fixed size."""
        self.flush(step.unit)
        self.pad(step.unit)
        writer = self.block_writer(step, "buffer_of", "buffer_writer")
        self.body.append(Put(call(writer, step.place.text)))
        self.position = self.position.skip(step.size)

    def check(self, condition: str, problem: str) -> None:
        """Emit a check; `validate` finds the field and the words afterwards."""
        raised = PlainStatement(f'raise ValueError("{problem}")')
        self.body.append(CompoundStatement(f"if {condition}:", (raised,)))

    def count(self, size: int | None, bound: int | None, count: str, path: str) -> None:
        """Emit the check of a size or bound, and the count of a sequence."""
        if size is not None:
            self.check(f"{count} != {size}", "wrong number of elements")
        elif bound is not None:
            self.check(f"{count} > {bound}", "too many elements")
        if size is None:
            self.field("I", 4, 4, count, path)
            self.flush(1)

    def buffer(self, place: plan.Slot, value: str, unit: int, bound: int | None = None) -> None:
        """Emit the count of a buffer's units, and the buffer."""
        local = place.local
        self.line(value, local)
        count = f"len({local})" if unit == 1 else f"len({local}) // {unit}"
        self.count(None, bound, count, place.path)
        self.put(local, f"len({local})", unit)

    def numbers(self, step: plan.NumbersStep) -> None:
        """Emit a numeric sequence."""
        local, value = step.place.local, step.place.text
        count = self.tables.local(f"{step.place.path}_count")
        dtype, arguments = step.info.dtype, f'order, "{step.info.code}"'
        if self.looping:
            copier = self.tables.function(f"bytes_of_{dtype}", f"sequence_copier({arguments})")
            self.line(call(copier, value), local)
            self.line(f"len({local})" + (f" // {step.unit}" if step.unit > 1 else ""), count)
        else:
            self.line(value, local)
            writer = self.tables.function(f"array_of_{dtype}", f"sequence_writer({arguments})")
            array = self.tables.function("array", "array_of(order)")
            converted = PlainStatement(call(writer, local), local)
            self.body.append(CompoundStatement(f"if type({local}) is not {array}:", (converted,)))
            self.line(f"len({local})", count)
            self.again.append(f"len({local}) != {count}")
        self.count(None, step.bound, count, step.place.path)
        self.elements(local, count, plan.Fixed(step.unit, step.unit, step.unit), unless=count)

    def texts(self, step: plan.StringsStep) -> None:
        """Emit an array or sequence of strings, its count included."""
        local, path = step.place.local, step.place.path
        self.flush(4)
        self.pad(4)
        arguments = ["order"]
        if step.size is not None:
            arguments.append(f"size={step.size}")
        elif step.bound is not None:
            arguments.append(f"bound={step.bound}")
        function = call("wide_block" if step.wide else "text_block", *arguments)
        self.line(call(self.tables.function(f"write_{path}", function), step.place.text), local)
        self.put(local, f"len({local})", 4 if step.wide else 1)

    def rows(self, step: plan.StructuresStep) -> None:
        """Emit structures of strings: sizes and ends are looked up, all is encoded once."""
        local = step.place.local
        path = step.place.path
        rows, block = self.tables.local(f"{path}_rows"), self.tables.local(f"{path}_block")
        sized = self.tables.function("sized", "sizes(order)")
        ended = self.tables.function("ended", "ENDS")
        places = [part.place for part in step.body if isinstance(part, plan.StringStep)]
        parts = [
            part
            for name in (place.local for place in places)
            for part in (f"{sized}[len({name})]", name, f"{ended}[len({name})]")
        ]
        lines = [PlainStatement(place.text, place.local) for place in places]
        lines.append(PlainStatement(Group("", tuple(parts)), rows, "+="))
        loop = f"for {step.item} in {local}"
        values = flat(Group("", tuple(place.text for place in places)))
        texts = Comprehension("each", (loop, f"for each in {values}"))
        unsized = call(self.tables.function("unsized", "unsized"), flat(texts))
        self.line(step.place.text, local)
        self.line("[]", f"{rows}: list[str]")
        attempt = CompoundStatement("try:", (CompoundStatement(f"{loop}:", tuple(lines)),))
        instead = CompoundStatement("except IndexError:", (PlainStatement(unsized, rows),))
        self.body.append(CompoundStatement(f"if len({local}):", (attempt, instead)))
        self.count(step.size, step.bound, f"len({rows}) // {len(parts)}", path)
        self.flush(4)
        self.pad(4)
        self.line(call(self.tables.function("write_rows", "rows_writer(order)"), rows), block)
        self.put(block, f"len({block})", 1)

    def items(self, step: plan.StructuresStep) -> None:
        """Emit an array or sequence of structures, as many as there are at one moment."""
        repeat = plan.fixed(step.body)
        only_texts = all(isinstance(part, plan.StringStep) and not part.wide for part in step.body)
        if only_texts and plan.is_many(step):
            self.rows(step)
            return
        local = step.place.local
        self.line(call(self.tables.function("listed", "listed"), step.place.text), local)
        self.count(step.size, step.bound, f"len({local})", step.place.path)

        def element() -> None:
            for part in step.body:
                self.step(part)
            self.flush(1)

        if repeat is None:
            self.flush(1)
            self.loop(f"for {step.item} in {local}:", element)
        else:
            self.fused(step, repeat)

    def fused(self, step: plan.StructuresStep, repeat: plan.Fixed) -> None:
        """Emit structures of constant size: one Struct, one join."""
        local = step.place.local
        self.flush(repeat.align)
        inner = _Encoder(self.tables, multiple_of(8), 8)
        paths = {step.item: step.item}
        for part in step.body:
            if isinstance(part, plan.Enter):
                paths[part.place.local] = f"{paths[part.place.owner]}.{part.place.slot}"
            elif isinstance(part, (plan.Number, plan.NumberBlock)):
                # a comprehension has attribute chains instead of variables
                place = replace(part.place, owner=paths[part.place.owner])
                inner.fixed(replace(part, place=place))
            elif isinstance(part, plan.Dummy):
                inner.fixed(part)
        writer = self.tables.struct("write", step.item, inner.run.fields, 4, "pack")
        row = Group(writer, tuple(inner.run.values))
        block = self.tables.local(f"{step.place.path}_block")
        gap = "\\x00" * (repeat.stride - repeat.size)
        blocks = Comprehension(row, (f"for {step.item} in {local}",))
        self.line(Group(f'b"{gap}".join', (blocks,)), block)
        self.elements(block, f"len({local})", repeat, unless=local if step.size is None else "")

    def elements(self, part: str, count: str, repeat: plan.Fixed, *, unless: str) -> None:
        """Emit elements of constant size; no padding goes before if `unless` is false."""
        gap = repeat.stride - repeat.size
        size = count if repeat.stride == 1 else f"{repeat.stride} * {count}"
        size += f" - {gap}" if gap else ""
        modulus = min(each & -each for each in (repeat.size, repeat.stride, 8))
        if not unless or (self.position.alignment.is_at(repeat.align) and not gap):
            self.pad(repeat.align)
            self.put(part, size, modulus)
            return
        self.pad(repeat.align, unless)
        self.body.append(Put(part))
        self.store_position("at")
        end = self.position.aligned(repeat.align).skip_by(size, 1)
        self.body.append(CompoundStatement(f"if {unless}:", (Note(end.text(), reads=True),)))
        self.position = self.position.with_alignment(multiple_of(4).modulo(modulus))
