"""From the values that are wanted of a message to the function that reads them.

What is in front of a value is passed over by its sizes and not judged, and what is behind all of
them is not looked at. Nothing is kept between two messages. The codec's own statements read what
is wanted, but strings and structures stand in variables instead of in a message.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from functools import partial

import msgspec

from idlc.diagnostics.text import did_you_mean
from idlc.generate.python.decode import UNENDED, Decoder, ReadRun, slice_of
from idlc.generate.python.lines import Block, Group, Line, call, text_of
from idlc.generate.python.positions import Cursor, NamedExpressions
from idlc.model import ir
from idlc.model.python_names import Locals
from idlc.wire import plan
from idlc.wire.layout import Messages, multiple_of

# paths, such as `header.stamp.sec`, `position[3]` or `name[*]`

#: A field's name, and the index of an element of it; `*` is all of them.
_PART = re.compile(r"(\w+)(?:\[(-?\d{1,10}|\*)\])?", re.ASCII)


class PathError(ValueError):
    """Paths that a structure does not have; the text has a line for each."""


class Wanted(msgspec.Struct):
    """The values to read in a value.

    `numbers` are those of the paths that end here, `type` is the value's. Elements are by their
    index, or by None if all of them are wanted.
    """

    type: ir.FieldType
    numbers: list[int] = []
    fields: dict[str, Wanted] = {}
    elements: dict[int | None, Wanted] = {}

    def all_numbers(self) -> list[int]:
        """Return the numbers of all paths that lead here or further."""
        inner = (*self.fields.values(), *self.elements.values())
        return [*self.numbers, *(number for node in inner for number in node.all_numbers())]


def wanted_values(paths: Iterable[str], message: ir.Message, messages: Messages) -> Wanted:
    """Return the tree of what paths lead to; raise PathError if some lead nowhere."""
    top = Wanted(ir.Ref(message.name))
    problems = []
    for number, path in enumerate(paths):
        try:
            _add(top, path, number, messages)
        except PathError as error:
            problems.append(str(error))
    if problems:
        raise PathError("\n".join(problems))
    return top


def _add(node: Wanted, path: str, number: int, messages: Messages) -> None:
    for part in path.split("."):
        match = _PART.fullmatch(part)
        if match is None:
            hint = "a path is written as in `header.stamp`, `position[3]` or `name[*]`"
            raise PathError(f"`{path}` is not a path: {hint}")
        name, index = match.groups()
        if not isinstance(node.type, ir.Ref):
            raise PathError(f"`{path}`: {_problem(node.type, name)}")
        fields = {field.name: field.type for field in messages[node.type.target].fields}
        if name not in fields:
            hint = did_you_mean(name, fields) or f"it has {', '.join(fields) or 'none'}"
            raise PathError(f"`{path}`: {node.type.target} has no field `{name}`; {hint}")
        node = node.fields.setdefault(name, Wanted(fields[name]))
        if index is not None:
            node = _element(node, path, name, None if index == "*" else int(index))
    node.numbers.append(number)


def _problem(type_: ir.FieldType, name: str) -> str:
    if isinstance(type_, (ir.Array, ir.Sequence)):
        return f"`{name}` is in the elements of a list: add an index such as `[0]`, or `[*]`"
    return f"there is no `{name}` in a {ir.spell(type_)}"


def _element(node: Wanted, path: str, name: str, index: int | None) -> Wanted:
    if not isinstance(node.type, (ir.Array, ir.Sequence)):
        raise PathError(f"`{path}`: `{name}` is not a list, so it has no index")
    most = node.type.size if isinstance(node.type, ir.Array) else node.type.bound
    if index is not None and most is not None and not -most <= index < most:
        raise PathError(f"`{path}`: `{name}` has at most {most} elements")
    return node.elements.setdefault(index, Wanted(node.type.element))


# readers

#: The expression of each path's value, by the number of the path.
Results = dict[int, str]
#: Types that can be read as nanoseconds, and their fields: a recording may define others so.
TIMES = {
    ir.TypeName("builtin_interfaces", "msg", "Time"),
    ir.TypeName("builtin_interfaces", "msg", "Duration"),
}
_SECONDS = [("sec", ir.Primitive("int32")), ("nanosec", ir.Primitive("uint32"))]

#: `other` reads another byte order, `slow` what this cannot read.
_HEAD = """\
def make(order, mark, other, slow):
{definitions}
    def read(data):
        try:
{body}
        except DecodeError:
            raise
        except FAILURES:
            pass
        return slow(data)

    return read
"""
_CHECK_ORDER = Block("if head != mark:", (Line("return other(data)"),))
#: What slices of a buffer need: Structs alone take any.
_SLICED = (
    Block(
        "if type(data) is not bytes:", (Line('memoryview(data).cast("B").toreadonly()', "data"),)
    ),
    Line("data", "view"),
    Line("len(data)", "limit"),
)
_SLICES = re.compile(r"\b(data|view|words)\[|\b(frombuffer|limit)\b")
#: The words of a buffer, among which are the sizes of strings.
_WORDS = (
    Line('memoryview(data)[: limit & -4].cast("I")', "words"),
    Block("if order != NATIVE:", (Line("swapped(words)", "words"),)),
)


def is_time(type_: ir.FieldType, messages: Messages) -> bool:
    """Return whether a value can be read as nanoseconds."""
    if not isinstance(type_, ir.Ref) or type_.target not in TIMES:
        return False
    return [(field.name, field.type) for field in messages[type_.target].fields] == _SECONDS


def reader_source(
    wanted: Wanted, count: int, messages: Messages, *, nanoseconds: bool, positions: bool
) -> str:
    """Return the text of a function that makes readers of `count` values, for one byte order.

    With `positions`, it reads where the values are instead. A single value is returned as it is,
    several as a tuple.
    """
    reader = _FieldReader(messages, nanoseconds, positions)
    results = reader.value(wanted, rest=False)
    reader.flush(last=True)
    values = [results[number] for number in range(count)]
    result = values[0] if count == 1 else f"({', '.join(values)})"
    reader.line(f"return {result}")
    if not reader.headed:
        head = reader.tables.struct("read", "head", ["H"], 0, "unpack_from")
        reader.body[:0] = [Line(call(head, "data"), "(head,)"), _CHECK_ORDER]
    body = "\n".join(text_of(tuple(reader.body), 12))
    first = _SLICED if _SLICES.search(body) else ()
    words = _WORDS if "words[" in body else ()
    body = "\n".join([*text_of((*first, *words), 12), body])
    definitions = "\n".join(text_of(reader.tables.definitions, 4))
    return _HEAD.format(definitions=definitions, body=body)


def texts_of(body: tuple[plan.Step, ...]) -> int:
    """Return how many strings an element consists of, or 0 if there is anything else in it."""
    parts = [step for step in body if not isinstance(step, plan.Enter)]
    are_texts = all(isinstance(step, plan.Text) and not step.wide for step in parts)
    return len(parts) if are_texts else 0


class _Makers(dict[ir.TypeName, str]):
    """The functions that make empty structures, each defined when it is first needed."""

    def __init__(self, tables: NamedExpressions) -> None:
        super().__init__()
        self.tables = tables

    def __missing__(self, type_: ir.TypeName) -> str:
        return self.tables.define("new", f"maker_of({str(type_)!r})")


class _FieldReader(Decoder):
    """Emits statements that read the wanted values and pass over others."""

    def __init__(self, messages: Messages, nanoseconds: bool, positions: bool) -> None:
        self.names = Locals()
        tables = NamedExpressions(self.names)
        super().__init__(tables, _Makers(tables), {}, "view")
        self.messages = messages
        self.nanoseconds = nanoseconds
        self.positions = positions
        self.headed = False

    def flush(self, *, last: bool = False) -> None:
        """Emit the run; the first one begins with the header, which tells the byte order."""
        run = self.run
        if self.headed or self.position.base or not run.fields:
            super().flush(last=last)
            return
        self.headed, self.run, self.unchecked = True, ReadRun(), False
        start = self.position.aligned(run.sizes[0][0]).offset
        fields = ["H", f"{start - 2}x", *run.fields]
        reader = self.tables.struct("read", run.path, fields, 0, "unpack_from")
        self.line(call(reader, "data"), Group("", ("head", *run.values)))
        self.body += [_CHECK_ORDER, *run.after]
        self.position = run.skipped(self.position)

    def value(self, wanted: Wanted, *, rest: bool) -> Results:
        """Read what is wanted of a value; with `rest`, go to its end."""
        tasks: list[Callable[[bool], Results]] = []
        if wanted.numbers:
            tasks.append(partial(self.whole, wanted))
        if wanted.fields:
            tasks.append(partial(self.fields, wanted))
        for index, element in wanted.elements.items():
            tasks.append(partial(self.elements, wanted.type, index, element))
        if rest and any(index is not None for index in wanted.elements):
            tasks.append(partial(self.passed, wanted.type))
        if len(tasks) == 1:
            return tasks[0](rest)
        start, results = self.marked(), Results()
        for number, task in enumerate(tasks):
            self.flush()
            self.position = start
            results |= task(rest and number == len(tasks) - 1)
        return results

    def marked(self) -> Cursor:
        """Return the position, in a variable of its own unless it is constant."""
        self.flush()
        if self.position.base:
            self.store_position(self.tables.local("start"))
        return self.position

    def fields(self, wanted: Wanted, rest: bool) -> Results:
        """Read fields of a structure."""
        assert isinstance(wanted.type, ir.Ref)
        results, missing = Results(), len(wanted.fields)
        for field in self.messages[wanted.type.target].fields:
            if not missing and not rest:
                break
            if field.name in wanted.fields:
                missing -= 1
                results |= self.value(wanted.fields[field.name], rest=rest or missing > 0)
            else:
                self.passed(field.type)
        return results

    # Values that are wanted.

    def steps(self, type_: ir.FieldType) -> tuple[plan.Step, ...]:
        """Return the steps of a value in a new variable."""
        local = self.names.new("value")
        holder = ir.TypeName("", "msg", "")
        place = plan.Place("", "", local, local, holder)
        if not isinstance(type_, ir.Ref):
            return (plan.step_of(type_, place, self.messages, self.names),)
        nested = self.messages[type_.target]
        enter = plan.Enter(place, type_.target, not nested.fields)
        return (enter, *plan.steps(nested, self.messages, self.names, local, local))

    def whole(self, wanted: Wanted, _rest: bool = False) -> Results:
        """Read a value as `deserialize` does, but numbers of a list as a view."""
        return dict.fromkeys(wanted.numbers, self.read(wanted.type))

    def read(self, type_: ir.FieldType) -> str:
        """Read a value; return its expression."""
        first, *others = self.steps(type_)
        assert not isinstance(first, plan.Dummy)
        local = first.place.local
        if self.positions:
            return self.found(first, local)
        if self.nanoseconds and is_time(type_, self.messages):
            seconds, nanoseconds = (
                step.place.local for step in others if isinstance(step, plan.Number)
            )
            for code, name in (("i", seconds), ("I", nanoseconds)):
                self.run.add(code, 4, name, name)
                self.run.sizes.append((4, 4))
            return f"{seconds} * 1000000000 + {nanoseconds}"
        if isinstance(first, plan.Numbers):
            count = self.count(first.bound, first.place.path)
            start = self.pass_elements(count, first.unit, first.unit)
            self.view(local, first.info.dtype, count, start)
        elif isinstance(first, plan.Block) and first.primitive not in plan.LIST_PRIMITIVES:
            self.passed_step(first)
            dtype = ir.PRIMITIVES[first.primitive].dtype
            self.view(local, dtype, str(first.count), self.position.text(-first.size))
        else:
            for step in (first, *others):
                self.step(step)
            if self.unchecked:  # what is read next may be in front of this
                self.short_if(f"{self.position.text()} > limit")
                self.unchecked = False
        return local

    def view(self, local: str, dtype: str, count: str, start: str) -> None:
        """Make an array of numbers over the buffer, which checks the bounds."""
        kind = self.tables.define(dtype, call("dtype", "order", f'"{dtype}"'))
        self.line(call("frombuffer", "data", kind, count, start), local)

    def found(self, step: plan.Step, local: str) -> str:
        """Store the position of a number or an array of them."""
        assert isinstance(step, (plan.Number, plan.Block))
        self.passed_step(step)
        self.line(self.position.text(-step.size), local)
        return local

    def make_nested(self, place: plan.Place, type_: ir.TypeName) -> tuple[Line, ...]:
        """Return the statements that make a nested object."""
        made = Line(call(self.makers[type_]), place.local)
        return (made, Line(place.local, place.text)) if place.owner else (made,)

    def texts(self, step: plan.Texts) -> None:
        """Read strings one by one: the codec's own function remembers those of the last message."""
        count = self.begin(step)
        self.line("[]", step.place.text)

        def element() -> None:
            local = self.names.new("text")
            place = plan.Place("", "", local, local, step.place.type)
            self.step(plan.Text(place, step.wide))
            self.line(call(f"{step.place.text}.append", local))

        self.loop(f"for _ in range({count}):", element)

    def text(self, place: plan.Place) -> str:
        """Read the size of a string; return the expression that reads the string."""
        self.number("size", place.path)
        start = self.start()
        self.line(f"{self.position.text(-1)} + size", "end")
        self.body.append(Block("if data[end]:", UNENDED))
        self.position = Cursor("end", 1, multiple_of(1))
        return f'str(data{slice_of(start)}, "utf-8")'

    # Elements of arrays and sequences.

    def elements(
        self, type_: ir.FieldType, index: int | None, wanted: Wanted, _rest: bool
    ) -> Results:
        """Read what is wanted of one element, or with None of each."""
        if index is None and isinstance(wanted.type, ir.Ref):
            return self.each(type_, wanted)
        if index is None:  # whole lists of what has no fields
            values = self.read(type_)
            if (
                isinstance(wanted.type, ir.Primitive)
                and wanted.type.name not in plan.LIST_PRIMITIVES
            ):
                values = f"{values}.tolist()"
            return dict.fromkeys(wanted.numbers, values)
        (step,) = self.steps(type_)
        if isinstance(type_, ir.Array):
            self.flush()
            place = str(index % type_.size)
        else:
            assert isinstance(type_, ir.Sequence)
            count = self.count(type_.bound, "count")
            place = str(index) if index >= 0 else self.tables.local("index")
            least = f"count <= {index}" if index >= 0 else f"count < {-index}"
            number = min(wanted.all_numbers())
            absent = call("absent", str(number), "count", self.position.text(-4))
            self.body.append(Block(f"if {least}:", (Line(f"raise {absent}"),)))
            if index < 0:
                self.line(f"{count} - {-index}", place)
        self.go_to(step, place)
        return self.value(wanted, rest=False)

    def go_to(self, step: plan.Step, place: str) -> None:
        """Go to an element of a list that has one at this place."""
        if isinstance(step, (plan.Numbers, plan.Block, plan.Bytes)):
            size = 1 if isinstance(step, plan.Bytes) else step.unit
            self.align(size)
            self.jump(size, place)
            return
        assert isinstance(step, (plan.Texts, plan.Items))
        if isinstance(step, plan.Texts) and not step.wide:
            self.pass_texts(place)
            return
        if isinstance(step, plan.Texts):
            self.repeat(place, partial(self.pass_text, True))
            return
        repeat = plan.fixed(step.body)
        if repeat is None:
            self.bounded(place, step)
            self.repeat(place, partial(self.pass_steps, step.body))
        else:
            self.align(repeat.align)
            self.jump(repeat.stride, place)

    def jump(self, size: int, place: str) -> None:
        """Go over as many elements as there are in front of a place."""
        if place.isdigit():
            self.position = self.position.skip(size * int(place))
        else:
            self.position = self.position.skip_by(f"{size} * {place}", size & -size)
            self.store_position("at")

    def each(self, type_: ir.FieldType, wanted: Wanted) -> Results:
        """Read what is wanted of each structure of a list, into lists."""
        (step,) = self.steps(type_)
        assert isinstance(step, plan.Items)
        count = self.begin(step)
        lists: Results = {number: self.tables.local("values") for number in wanted.all_numbers()}
        for values in lists.values():
            self.line("[]", values)

        def element() -> None:
            results = self.value(wanted, rest=True)
            self.flush()
            for number, values in lists.items():
                self.line(call(f"{values}.append", results[number]))

        self.bounded(count, step)
        self.repeat(count, element)
        return lists

    # What is passed over.

    def passed(self, type_: ir.FieldType, _rest: bool = True) -> Results:
        """Go over a value."""
        self.pass_steps(self.steps(type_))
        return {}

    def pass_steps(self, steps: tuple[plan.Step, ...]) -> None:
        """Go over values."""
        for step in steps:
            self.passed_step(step)

    def passed_step(self, step: plan.Step) -> None:
        """Go over one value, which is not judged."""
        match step:
            case plan.Number() | plan.Dummy() | plan.Block():
                self.flush()
                self.align(step.unit)
                self.position = self.position.skip(step.size)
            case plan.Text(_, wide):
                self.pass_text(wide)
            case plan.Numbers() | plan.Bytes():
                unit = step.unit if isinstance(step, plan.Numbers) else 1
                self.pass_elements(self.count(None, "count"), unit, unit)
            case plan.Texts(wide=True):
                self.repeat(self.length(step), partial(self.pass_text, True))
            case plan.Texts():
                self.pass_texts(self.length(step))
            case plan.Items():
                count, repeat = self.length(step), plan.fixed(step.body)
                texts = texts_of(step.body)
                if texts:
                    self.pass_texts(count if texts == 1 else f"{texts} * {count}")
                elif repeat is not None and repeat.stride == repeat.size:
                    self.pass_elements(count, repeat.align, repeat.size)
                else:
                    self.bounded(count, step)
                    self.repeat(count, partial(self.pass_steps, step.body))

    def length(self, step: plan.Texts | plan.Items) -> str:
        """Read the count of a list that is passed over, or return its size."""
        if step.size is None:
            return self.count(None, "count")
        self.flush()
        return str(step.size)

    def pass_text(self, wide: bool) -> None:
        """Go over a string."""
        self.number("size", "size")
        self.line(f"{self.position.text()} + {'4 * ' * wide}size", "end")
        self.position = Cursor("end", 0, multiple_of(4 if wide else 1))

    def pass_texts(self, count: str) -> None:
        """Go over many strings: of all but the last, the next begins at a multiple of four."""
        self.align(4)
        self.store_position("at")
        self.line("at", "end")
        word = self.tables.local("word")
        following = Line(f"words[{word}] + 7 >> 2", word, "+=")
        self.body.append(
            Block(
                f"if {count}:",
                (
                    Line("at >> 2", word),
                    Block(f"for _ in range({count} - 1):", (following,)),
                    Line(f"4 * {word} + 4 + words[{word}]", "end"),
                ),
            )
        )
        self.position = Cursor("end", 0, multiple_of(1))

    def bounded(self, count: str, step: plan.Items) -> None:
        """Check that a buffer can hold so many elements, before a loop over them."""
        if step.size is None:
            self.short_if(f"{plan.smallest(step.body)} * {count} > limit")

    def repeat(self, count: str, emit: Callable[[], None]) -> None:
        """Emit a loop, or what is in it if that is needed less than twice."""

        def element() -> None:
            emit()
            self.flush()

        if count == "1":
            element()
        elif count != "0":
            self.loop(f"for _ in range({count}):", element)
