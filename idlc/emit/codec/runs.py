"""Values of fixed size that are read together, and the position after them."""

from __future__ import annotations

from idlc.emit.codec.alignment import multiple_of
from idlc.emit.codec.constants import Tables
from idlc.emit.codec.cursor import START, Cursor
from idlc.emit.codec.statements import Block, Emitter, Line, Statement
from idlc.emit.python_lines import Group, call, tuple_of

TOO_SHORT = (Line('raise ValueError("too short")'),)
TOO_MANY = (Line('raise ValueError("too many elements")'),)


class Run:
    """Fixed-size values that are read together."""

    def __init__(self) -> None:
        self.fields: list[str] = []
        self.targets: list[str] = []
        self.sizes: list[tuple[int, int]] = []
        self.after: list[Statement] = []

    def add(self, token: str, align: int, size: int, target: str = "") -> None:
        """Add a value of `size` bytes, stored in `target`."""
        self.fields.append(token)
        self.sizes.append((align, size))
        if target:
            self.targets.append(target)

    def skipped(self, cursor: Cursor) -> Cursor:
        """Return the position after the values, of which the first is at `cursor`."""
        for align, size in self.sizes:
            if not cursor.known.knows(align):
                cursor = cursor.where(multiple_of(align))
            cursor = cursor.skip(cursor.known.padding(align) + size)
        return cursor

    def assignment(self, value: Group) -> Line:
        """Return the statement that reads the values."""
        return Line(value, tuple_of(*self.targets)) if self.targets else Line(value)


class Running(Emitter):
    """Statements that read: those so far, the values to be read together, the position before them.

    `source` is what buffers are cut from. `limited` is whether a check needs the buffer's size,
    `unchecked` whether nothing has noticed yet that a buffer was cut short. With `worded`, the
    sizes of strings are in `words` and their text in `chars`.
    """

    def __init__(self, tables: Tables, source: str) -> None:
        super().__init__()
        self.tables = tables
        self.source = source
        self.here = START
        self.run = Run()
        self.limited = False
        self.unchecked = False
        self.worded = False

    def flush(self, *, last: bool = False) -> None:
        """Read the run; the position after it is of no interest if it is the `last`."""
        run, self.run = self.run, Run()
        if not run.fields:
            return
        self.unchecked = False
        widest = max(align for align, _ in run.sizes)
        if run.sizes[0][0] == widest:
            self.align(widest)
        fields = "".join(run.fields)
        here = self.here.text()
        if self.worded and fields == "I":
            self.line(f"words[{self.here.text(4)} >> 2]", run.targets[0])
            self.here = run.skipped(self.here)
        elif self.here.known.knows(widest):
            reader = self.tables.reader(fields, self.here.known.residue)
            self.body.append(run.assignment(call(reader, "data", here)))
            self.here = run.skipped(self.here)
        else:
            table = f"{self.tables.reader(fields, None)}[{here} & 7]"
            struct = table if last else "struct"
            if not last:
                self.line(table, struct)
            self.body.append(run.assignment(call(f"{struct}.unpack_from", "data", here)))
            if not last:
                self.line(f"{here} + struct.size", "at")
                self.here = run.skipped(self.here).at("at")
        self.body += run.after

    def align(self, align: int) -> None:
        """Go to the next multiple of `align`, counted from the end of the header."""
        if self.here.known.knows(align):
            self.here = self.here.skip(self.here.known.padding(align))
        elif align == 8:
            self.line(f"({self.here.text(3)} & -8) + 4", "at")
            self.here = Cursor("at", 0, multiple_of(8))
        else:
            lead = 4 if self.worded and align == 4 else 0  # what comes after the size
            self.line(f"{self.here.text(align - 1 + lead)} & -{align}", "at")
            self.here = Cursor("at", -lead, multiple_of(align))

    def settle(self, base: str, offset: int = 0) -> None:
        """Bring the position into a variable, as `base + offset`."""
        value = self.here.text(-offset)
        if value != base:
            self.line(value, base)
        self.here = self.here.at(base, offset)

    def number(self, target: str) -> None:
        """Read a count or size into a variable, together with the numbers before it."""
        self.run.add("I", 4, 4, target)
        self.flush()

    def count(self, bound: int | None) -> str:
        """Read the count of a sequence and check its upper limit."""
        self.number("count")
        if bound is not None:
            self.body.append(Block(f"if count > {bound}:", TOO_MANY))
        return "count"

    def start(self) -> str:
        """Return the position as an expression that stays true when `end` changes."""
        if self.here.base == "end":
            self.settle("at")
        return self.here.text()

    def buffer(self, count: str, align: int, size: int, source: str) -> str:
        """Return the slice of `count` elements, and move after it.

        It is shorter if the buffer is, which whatever is read next notices.
        """
        if not self.here.known.is_at(align):
            self.settle("at")
            self.body.append(Block(f"if {count}:", (Line("(at + 3 & -8) + 4", "at"),)))
            self.here = self.here.where(multiple_of(4))
        start = self.start()
        self.line(f"{start} + {count}" if size == 1 else f"{start} + {size} * {count}", "end")
        self.unchecked = True
        self.here = Cursor("end", 0, self.here.known.modulo(size & -size))
        return f"{source}{slice_of(start)}"

    def finish(self) -> None:
        """Emit the check that nothing after the last buffer makes."""
        if self.unchecked:
            self.short_if(f"{self.here.text()} > limit")

    def short_if(self, condition: str) -> None:
        """Emit a check that the buffer is long enough."""
        self.limited = True
        self.body.append(Block(f"if {condition}:", TOO_SHORT))


def slice_of(start: str, end: str = "end") -> str:
    """Return the slice from one expression to another."""
    if " " in start + end:
        return f"[{start} : {end}]"
    return f"[{start}:{end}]"
