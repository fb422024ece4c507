"""From a layout to the statements that read it.

Numbers that follow each other are read by one precompiled Struct. A Struct and an index check
their own bounds; before a sequence is read, its size is compared with the bytes that are left,
so nothing is allocated that the buffer does not hold. Any failure is explained afterwards, by
the runtime.
"""

from __future__ import annotations

from idlc.emit import layout
from idlc.emit.code import Block, Line, Statement
from idlc.emit.pretty import Comprehension, Group, Node, call
from idlc.emit.tables import Tables
from idlc.emit.encode import block_code, inlined
from idlc.model import ir

SHORT = Line('raise ValueError("too short")')


def is_bulk(steps: tuple[layout.Step, ...]) -> bool:
    """Whether a structure holds numeric sequences, which are read through a memoryview."""
    return any(
        isinstance(step, layout.Numbers) or (isinstance(step, layout.Items) and is_bulk(step.body))
        for step in steps
    )


def decode(
    steps: tuple[layout.Step, ...], tables: Tables, own: str, makers: dict[ir.TypeName, str]
) -> tuple[Statement, ...]:
    """Return the statements that read a message; what they use is defined in `tables`.

    `own` and `makers` name the functions that make empty objects.
    """
    decoder = _Decoder(tables, makers, is_bulk(steps))
    if decoder.bulk:
        decoder.line("memoryview(data)", "view")
    decoder.line(f"{own}()", "message")
    for step in steps:
        decoder.step(step)
    decoder.flush()
    decoder.body.append(Line("return message"))
    return tuple(decoder.body)


class _Decoder:
    """The statements so far, the numbers to be read together, and the position before them.

    The position is `at + offset`, or `offset` as long as it is constant.
    """

    def __init__(self, tables: Tables, makers: dict[ir.TypeName, str], bulk: bool) -> None:
        self.tables = tables
        self.makers = makers
        self.bulk = bulk
        self.body: list[Statement] = []
        self.base = ""
        self.offset = 4
        self.modulus = 8
        self.residue = 4
        self.fields: list[str] = []
        self.targets: list[str] = []
        self.sizes: list[tuple[int, int]] = []
        self.after: list[Statement] = []

    @property
    def at(self) -> str:
        """The position as an expression."""
        if not self.base:
            return str(self.offset)
        if self.offset < 0:
            return f"{self.base} - {-self.offset}"
        return f"{self.base} + {self.offset}" if self.offset else self.base

    def moved(self, by: int) -> str:
        """The position `by` bytes later as an expression."""
        self.offset += by
        text = self.at
        self.offset -= by
        return text

    def line(self, value: Node, target: Node = "") -> None:
        """Emit a statement."""
        self.body.append(Line(value, target))

    def step(self, step: layout.Step) -> None:
        """Emit one step."""
        match step:
            case layout.Number(place, letter, size):
                self.field(letter, size, size, place.text)
            case layout.Dummy():
                self.field("x", 1, 1)
            case layout.Block(place, primitive, count):
                raw = place.local
                self.field(f"{count}{block_code(primitive)}", step.unit, step.size, raw)
                reader = self.tables.block_reader(step)
                self.after.append(Line(call(reader, raw), place.text))
            case layout.Enter(place, type_):
                self.line(f"{self.makers[type_]}()", place.local)
                self.line(place.local, place.text)
            case layout.Text(place, wide):
                self.wide_text(place.text) if wide else self.text(place.text)
            case layout.Bytes(place, primitive, bound):
                reader = "read_flags" if primitive == "bool" else "read_octets"
                raw = self.buffer(self.count(bound), 1)
                self.line(call(self.tables.function(reader, reader), raw), place.text)
            case layout.Numbers(place, _, bound):
                raw = self.buffer(self.count(bound), step.unit)
                reader = self.tables.sequence_reader(step)
                self.line(call(reader, raw), place.text)
            case layout.Texts():
                self.texts(step)
            case layout.Items():
                self.items(step)

    # Numbers that follow each other are read together.

    def field(self, token: str, align: int, size: int, target: str = "") -> None:
        """Add a value to what is read next."""
        self.fields.append(token)
        self.sizes.append((align, size))
        if target:
            self.targets.append(target)

    def flush(self, *, last: bool = True) -> None:
        """Read the values gathered; unless `last`, the position after them is kept."""
        if not self.fields:
            return
        widest = max(align for align, _ in self.sizes)
        leading = self.sizes[0][0]
        if widest > self.modulus and leading == widest:
            self.align(widest)
        fields = "".join(self.fields)
        target: Node = Group("", tuple(self.targets))
        if widest <= self.modulus:
            reader = self.tables.struct("read", fields, self.residue, "unpack_from")
            self.read(call(reader, "data", self.at), target)
            for align, size in self.sizes:
                self.skip((4 - self.residue) % align + size)
        else:
            self.phased(fields, target, last)
        self.body += self.after
        self.fields, self.targets, self.sizes, self.after = [], [], [], []

    def read(self, value: Group, target: Node) -> None:
        """Emit the reading of values; none at all for a dummy, which is only skipped."""
        if isinstance(target, Group) and not target.items:
            self.line(value)
        else:
            self.line(value, target)

    def phased(self, fields: str, target: Node, last: bool) -> None:
        """Read values whose padding depends on the position."""
        table = self.tables.struct("read", fields, None, "")
        index = f"{self.at} & 7"
        if last:
            self.read(call(f"{table}[{index}].unpack_from", "data", self.at), target)
            return
        chosen = "struct"
        self.line(f"{table}[{index}]", chosen)
        self.read(call(f"{chosen}.unpack_from", "data", self.at), target)
        self.line(f"{self.at} + {chosen}.size", "at")
        self.base, self.offset = "at", 0
        for align, size in self.sizes:
            if align > self.modulus:
                self.modulus, self.residue = align, 4 % align
            else:
                self.residue = (self.residue + (4 - self.residue) % align) % self.modulus
            self.residue = (self.residue + size) % self.modulus

    def skip(self, size: int) -> None:
        """Go a constant number of bytes ahead."""
        self.offset += size
        self.residue = (self.residue + size) % self.modulus

    def align(self, align: int) -> None:
        """Go to the next multiple of `align`, counted from the end of the header."""
        if self.modulus >= align:
            self.skip((4 - self.residue) % align)
            return
        if align == 8:
            self.line(f"({self.moved(3)} & -8) + 4", "at")
        else:
            self.line(f"{self.moved(align - 1)} & -{align}", "at")
        self.base, self.offset = "at", 0
        self.modulus, self.residue = align, 4 % align

    def settle(self) -> None:
        """Bring the position into `at`."""
        if self.at != "at":
            self.line(self.at, "at")
        self.base, self.offset = "at", 0

    # Values of variable size.

    def number(self, target: str) -> str:
        """Read a count or size into a variable, together with the numbers before it."""
        self.field("I", 4, 4, target)
        self.flush(last=False)
        return target

    def count(self, bound: int | None) -> str:
        """Read the count of a sequence and check its upper limit."""
        count = self.number("count")
        if bound is not None:
            raised = Line('raise ValueError("too many elements")')
            self.body.append(Block(f"if {count} > {bound}:", (raised,)))
        return count

    def start(self) -> str:
        """Return the position as an expression that stays true while `end` changes."""
        if self.base == "end":
            self.settle()
        return self.at

    def slice(self, start: str, end: str) -> str:
        """Return a slice of the buffer."""
        if not start.isidentifier() and not start.isdigit() or not end.isidentifier():
            return f"[{start} : {end}]"
        return f"[{start}:{end}]"

    def text(self, target: str) -> None:
        """Read a string; the index of its last byte checks the bounds."""
        self.number("size")
        start = self.start()
        self.line(f"{self.moved(-1)} + size", "end")
        part = f"{start} : end + (data[end] > 0)"
        if self.bulk:
            self.line(call("str", f"data[{part}]", '"utf-8"', '"replace"'), target)
        else:
            self.line(Group("data", (part,), ".decode()", "[]", ""), target)
        self.base, self.offset = "end", 1
        self.modulus, self.residue = 1, 0

    def wide_text(self, target: str) -> None:
        """Read a wstring."""
        raw = self.buffer(self.number("count"), 4, "data")
        reader = self.tables.function("read_wide_text", "read_wide_text(order)")
        self.line(call(reader, raw), target)

    def buffer(self, count: str, unit: int, source: str = "") -> str:
        """Check that elements are there; return the slice that holds them, and go behind it."""
        source = source or ("view" if self.bulk else "data")
        if self.modulus < unit or (4 - self.residue) % unit:
            self.settle()
            aligned = Line(f"({self.at} + 3 & -8) + 4", "at")
            self.body.append(Block(f"if {count}:", (aligned,)))
            self.modulus, self.residue = 4, 0
        start = self.start()
        size = count if unit == 1 else f"{unit} * {count}"
        self.line(f"{start} + {size}", "end")
        self.body.append(Block("if end > len(data):", (SHORT,)))
        self.base, self.offset = "end", 0
        self.modulus = min(self.modulus, unit)
        self.residue %= self.modulus
        return f"{source}{self.slice(start, 'end')}"

    def least(self, count: str, size: int) -> None:
        """Check that `count` elements of at least `size` bytes can be there."""
        wanted = count if size == 1 else f"{size} * {count}"
        self.body.append(Block(f"if {self.at} + {wanted} > len(data):", (SHORT,)))

    def texts(self, step: layout.Texts) -> None:
        """Read an array or sequence of strings."""
        local = step.place.local
        count = self.begin(step)
        if step.size is None:
            self.least(count, 4)
        self.line("[]", local)
        self.line(local, step.place.text)

        def body() -> None:
            if step.wide:
                self.wide_text("value")
                self.line(call(f"{local}.append", "value"))
            else:
                self.text("value")
                self.line(call(f"{local}.append", "value"))

        self.loop(f"for _ in range({count}):", body)

    def begin(self, step: layout.Texts | layout.Items) -> str:
        """Read the count, or return the size."""
        if step.size is not None:
            self.flush(last=False)
            return str(step.size)
        return self.count(step.bound)

    def items(self, step: layout.Items) -> None:
        """Read an array or sequence of structures."""
        local = step.place.local
        count = self.begin(step)
        self.line("[]", local)
        self.line(local, step.place.text)
        repeat = layout.fixed(step.body)
        if repeat is not None and repeat.stride == repeat.size:
            self.fused(step, repeat, count)
            return
        if step.size is None:
            self.least(count, layout.smallest(step.body))

        def body() -> None:
            self.line(f"{self.makers[step.type]}()", step.item)
            self.line(call(f"{local}.append", step.item))
            for part in step.body:
                self.step(part)
            self.flush(last=False)

        self.loop(f"for _ in range({count}):", body)

    def fused(self, step: layout.Items, repeat: layout.Fixed, count: str) -> None:
        """Read structures of constant size, one Struct each, without positions."""
        local = step.place.local
        if step.size is not None:
            self.align(repeat.align)
        fields, targets, after = [], [], []
        enters: list[Statement] = []
        for part in step.body:
            match part:
                case layout.Number(place, letter):
                    fields.append(letter)
                    targets.append(place.text)
                case layout.Dummy():
                    fields.append("x")
                case layout.Block(place, primitive, size):
                    fields.append(f"{size}{block_code(primitive)}")
                    targets.append(place.local)
                    reader = self.tables.block_reader(part)
                    after.append(Line(call(reader, place.local), place.text))
                case layout.Enter(place, type_):
                    enters.append(Line(f"{self.makers[type_]}()", place.local))
                    enters.append(Line(place.local, place.text))
                case _:
                    pass
        reader = self.tables.struct("rows", "".join(fields), 4, "iter_unpack")
        values = self.tables.local(f"{step.item}_values")
        rows = self.buffer_of(repeat, count)
        body = [
            Line(f"{self.makers[step.type]}()", step.item),
            Line(call(f"{local}.append", step.item)),
            *enters,
        ]
        if targets:
            body.append(Line(values, Group("", tuple(targets))))
        body += after
        self.body.append(Block(f"for {values} in {reader}({rows}):", tuple(body)))

    def buffer_of(self, repeat: layout.Fixed, count: str) -> str:
        """Return the slice that holds `count` elements of constant size."""
        if self.modulus < repeat.align or (4 - self.residue) % repeat.align:
            self.settle()
            aligned = Line(f"({self.at} + 3 & -8) + 4", "at")
            self.body.append(Block(f"if {count}:", (aligned,)))
            self.modulus, self.residue = 4, 0
        start = self.start()
        self.line(f"{start} + {repeat.size} * {count}", "end")
        self.body.append(Block("if end > len(data):", (SHORT,)))
        self.base, self.offset = "end", 0
        self.modulus = min(self.modulus, repeat.size & -repeat.size)
        self.residue %= self.modulus
        return f"{'view' if self.bulk else 'data'}{self.slice(start, 'end')}"

    def loop(self, head: str, body: object) -> None:
        """Emit a loop whose body begins and ends with the position in `at`."""
        assert callable(body)
        self.settle()
        outside = self.body
        modulus, residue = self.modulus, self.residue
        while True:
            mark = self.tables.mark()
            self.body = []
            self.base, self.offset, self.modulus, self.residue = "at", 0, modulus, residue
            body()
            self.settle()
            met = min(modulus, self.modulus)
            while residue % met != self.residue % met:
                met //= 2
            if met == modulus:
                break
            modulus, residue = met, residue % met
            self.tables.reset(mark)
        outside.append(Block(head, tuple(self.body)))
        self.body = outside
        self.modulus, self.residue = modulus, residue


__all__ = ["Comprehension", "decode", "inlined", "is_bulk"]
