"""From paths to a function that reads the values at them from a serialized message.

What is in front of a value is passed over by its sizes and not judged, and what is behind all of
them is not looked at. Nothing is kept between two messages. The codec's own statements read the
values, but into variables instead of into a message.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

from idlc.diagnostics.text import did_you_mean
from idlc.generate.python.decode import UNENDED, Decoder, slice_of
from idlc.generate.python.statements import (
    CompoundStatement,
    Cursor,
    Group,
    NamedExpressions,
    PlainStatement,
    call,
    text_of,
)
from idlc.model import ir
from idlc.model.python_names import Locals
from idlc.wire import plan
from idlc.wire.layout import Messages, multiple_of

# paths, such as `header.stamp.sec`, `position[3]` or `name[*]`

#: A field's name, and the index of an element of it; `*` is all of them.
_PART = re.compile(r"(\w+)(?:\[(-?\d{1,10}|\*)\])?", re.ASCII)


class PathError(ValueError):
    """Paths that a structure does not have; the text has a line for each."""


class PathStep(NamedTuple):
    """A field, and the index of the element in it that a path leads to, or `*`."""

    name: str
    place: int | str | None


class Path(NamedTuple):
    """The way to a value of a type, or with a `*` to many; `next` is that to the next field."""

    text: str
    parts: tuple[PathStep, ...]
    type: ir.FieldType
    next: str

    @property
    def has_many(self) -> bool:
        """Return whether it leads to the values of all elements of a list."""
        return any(part.place == "*" for part in self.parts)


def paths_of(texts: Sequence[str], message: ir.Message, messages: Messages) -> tuple[Path, ...]:
    """Return what texts mean in a structure; raise PathError if some lead nowhere."""
    paths, problems = [], []
    for text in texts:
        try:
            paths.append(_path(text, message, messages))
        except PathError as error:
            problems.append(str(error))
    if problems:
        raise PathError("\n".join(problems))
    return tuple(paths)


def _path(text: str, message: ir.Message, messages: Messages) -> Path:
    type_: ir.FieldType = ir.Ref(message.name)
    parts: list[PathStep] = []
    for word in text.split("."):
        match = _PART.fullmatch(word)
        if match is None:
            hint = "a path is written as in `header.stamp`, `position[3]` or `name[*]`"
            raise PathError(f"`{text}` is not a path: {hint}")
        name, index = match.groups()
        if not isinstance(type_, ir.Ref):
            problem = f"there is no `{name}` in a {ir.spell(type_)}"
            if isinstance(type_, (ir.Array, ir.Sequence)):
                of = parts[-1].name
                rest = f".{name}" if isinstance(type_.element, ir.Ref) else ""
                problem = f"`{of}` is a list: write `{of}[0]{rest}` or `{of}[*]{rest}`"
            raise PathError(f"`{text}`: {problem}")
        fields = {field.name: field.type for field in messages[type_.target].fields}
        if name not in fields:
            hint = did_you_mean(name, fields) or f"it has {', '.join(fields) or 'none'}"
            raise PathError(f"`{text}`: {type_.target} has no field `{name}`; {hint}")
        part = PathStep(name, int(index) if index not in (None, "*") else index)
        type_ = fields[name] if index is None else _element(text, part, fields[name])
        parts.append(part)
    following = [*fields, "", ""][[*fields].index(name) + 1]
    before = text.removesuffix(word)
    return Path(text, tuple(parts), type_, f"{before}{following}" if index is None else "")


def _element(text: str, part: PathStep, type_: ir.FieldType) -> ir.FieldType:
    if not isinstance(type_, (ir.Array, ir.Sequence)):
        raise PathError(f"`{text}`: `{part.name}` is not a list, so it has no index")
    most = type_.size if isinstance(type_, ir.Array) else type_.bound
    if isinstance(part.place, int) and most is not None and not -most <= part.place < most:
        raise PathError(f"`{text}`: `{part.name}` has at most {most} elements")
    return type_.element


# readers

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
_CHECK_ORDER = CompoundStatement("if head != mark:", (PlainStatement("return other(data)"),))
#: What slices of a buffer need: Structs alone take any.
_SLICED = (
    CompoundStatement(
        "if type(data) is not bytes:",
        (PlainStatement('memoryview(data).cast("B").toreadonly()', "data"),),
    ),
    PlainStatement("len(data)", "limit"),
)
_SLICES = re.compile(r"\bdata\[|\b(words|frombuffer|limit|sequence_of_\w+|array_of_\w+)\b")
_WORDS = PlainStatement("words_of(data, limit, order)", "words")


def is_time(type_: ir.FieldType, messages: Messages) -> bool:
    """Return whether a value can be read as nanoseconds."""
    if not isinstance(type_, ir.Ref) or type_.target not in TIMES:
        return False
    return [(field.name, field.type) for field in messages[type_.target].fields] == _SECONDS


def reader_source(
    top: ir.TypeName,
    paths: Sequence[Path],
    messages: Messages,
    *,
    nanoseconds: bool,
    positions: bool,
) -> str:
    """Return the text of a function that makes readers of a structure, for one byte order.

    A single value is returned as it is, several as a tuple. With `positions`, a tuple says where
    the values are instead.
    """
    reader = _FieldReader(messages, nanoseconds, positions, len(paths) > 1)
    values: list[str] = []
    for number, path in enumerate(paths):
        if number and path.text == paths[number - 1].next and not path.has_many:
            values.append(reader.read(path.type))
            continue
        reader.flush()
        reader.number_of_path, reader.position = number, Cursor("", 4, multiple_of(8))
        values.append(reader.value(ir.Ref(top), path.parts, ()))
    reader.flush(last=True)
    is_single = len(values) == 1 and not positions
    result = values[0] if is_single else f"({', '.join(values)},)"
    reader.line(f"return {result}")
    if not reader.headed:
        head = reader.tables.struct("read", "head", ["H"], 0, "unpack_from")
        reader.body[:0] = [PlainStatement(call(head, "data"), "(head,)"), _CHECK_ORDER]
    body = "\n".join(text_of(tuple(reader.body), 12))
    first = _SLICED if _SLICES.search(body) else ()
    words = (_WORDS,) if "words" in body else ()
    body = "\n".join([*text_of((*first, *words), 12), body])
    definitions = "\n".join(text_of(reader.tables.definitions, 4))
    return _HEAD.format(definitions=definitions, body=body)


def _texts_of(body: tuple[plan.Step, ...]) -> int:
    """Return how many strings an element consists of, or 0 if there is anything else in it."""
    parts = [step for step in body if not isinstance(step, plan.Enter)]
    are_texts = all(isinstance(step, plan.StringStep) and not step.wide for step in parts)
    return len(parts) if are_texts else 0


def _repeated(step: plan.Step) -> plan.Fixed | None:
    """Return how the elements of a list repeat, or None if that depends on their values."""
    match step:
        case plan.NumbersStep() | plan.NumberBlock():
            return plan.Fixed(step.unit, step.unit, step.unit)
        case plan.Bytes():
            return plan.Fixed(1, 1, 1)
        case plan.StructuresStep():
            return plan.fixed(step.body)
    return None


class _Makers(dict[ir.TypeName, str]):
    """The functions that make empty structures, each defined when it is first needed."""

    def __init__(self, tables: NamedExpressions) -> None:
        super().__init__()
        self.tables = tables

    def __missing__(self, type_: ir.TypeName) -> str:
        return self.tables.define("new", f"maker_of({str(type_)!r})")


class _FieldReader(Decoder):
    """Emits statements that read values and pass over others; `shares`: for several paths."""

    def __init__(
        self, messages: Messages, nanoseconds: bool, positions: bool, shares: bool
    ) -> None:
        self.names = Locals()
        tables = NamedExpressions(self.names)
        super().__init__(tables, _Makers(tables), {}, bulk=True)
        self.messages = messages
        self.nanoseconds = nanoseconds
        self.positions = positions
        self.shares = shares
        self.headed = False
        self.number_of_path = 0
        #: The positions after fields, by the way to them.
        self.known: dict[tuple[object, ...], Cursor] = {}

    def flush(self, *, last: bool = False) -> None:
        """Emit the run; the first one begins with the header, which tells the byte order."""
        run = self.run
        if self.headed or self.body or self.position.base or not run.fields:
            super().flush(last=last)
            return
        self.headed, self.run, self.unchecked = True, type(run)(), False
        self.make_arrays(run)
        start = self.position.aligned(run.sizes[0][0]).offset
        fields = ["H", f"{start - 2}x", *run.fields]
        reader = self.tables.struct("read", run.path, fields, 0, "unpack_from")
        self.line(call(reader, "data"), Group("", ("head", *run.values)))
        self.body += [_CHECK_ORDER, *run.after]
        self.position = run.skipped(self.position)

    def marked(self) -> Cursor:
        """Return the position, which stays true when other values are read."""
        self.flush()
        if self.position.masked or self.position.base in ("at", "end"):
            self.store_position(self.tables.local("start"))
        return self.position

    # Values at paths.

    def value(
        self, type_: ir.FieldType, parts: tuple[PathStep, ...], way: tuple[object, ...]
    ) -> str:
        """Read the value at the rest of a path, `way` leads here; return its expression.

        In the elements of a list, go to the end of what the path is in.
        """
        if not parts:
            return self.read(type_)
        assert isinstance(type_, ir.Ref)
        part, rest = parts[0], parts[1:]
        fields = iter(self.messages[type_.target].fields)
        for field in fields:
            if field.name == part.name:
                break
            self.pass_field((*way, field.name), field.type)
        if part.place is None:
            value = self.value(field.type, rest, (*way, *part))
        else:
            assert isinstance(field.type, (ir.Array, ir.Sequence))
            value = self.elements(field.type, part.place, rest, (*way, *part))
        if "*" in way:
            for field in fields:
                self.pass_field(way, field.type)
        return value

    def elements(
        self,
        type_: ir.Array | ir.Sequence,
        index: int | str,
        parts: tuple[PathStep, ...],
        way: tuple[object, ...],
    ) -> str:
        """Read the value at the rest of a path from one element of a list, or from each."""
        if isinstance(index, int):
            start = self.marked()
            self.go_to(type_, index)
            value = self.value(type_.element, parts, way)
            if "*" in way:
                self.flush()
                self.position = start
                self.pass_steps(self.steps(type_))
            return value
        if parts or self.is_nanoseconds(type_.element):
            return self.each(type_, parts, way)
        values = self.read(type_)
        return f"{values}.tolist()" if _is_numeric(type_.element) else values

    def pass_field(self, way: tuple[object, ...], type_: ir.FieldType) -> None:
        """Go over a field, unless the position after it is known from another path."""
        if way in self.known:
            self.flush()
            self.position = self.known[way]
            return
        self.pass_steps(self.steps(type_))
        if self.shares and not self.looping:
            self.known[way] = self.marked()

    def steps(self, type_: ir.FieldType) -> tuple[plan.Step, ...]:
        """Return the steps of a value in a new variable."""
        local = self.names.new("value")
        place = plan.Slot("", "", local, local, ir.TypeName("", "msg", ""))
        if not isinstance(type_, ir.Ref):
            return (plan.step_of(type_, place, self.messages, self.names),)
        nested = self.messages[type_.target]
        enter = plan.Enter(place, type_.target, not nested.fields)
        return (enter, *plan.steps(nested, self.messages, self.names, local, local))

    def is_nanoseconds(self, type_: ir.FieldType) -> bool:
        """Return whether values of a type are read as nanoseconds."""
        return self.nanoseconds and is_time(type_, self.messages)

    def read(self, type_: ir.FieldType) -> str:
        """Read a value as `deserialize` does, but numbers of a list as a view."""
        first, *others = self.steps(type_)
        assert not isinstance(first, plan.Dummy)
        local = first.place.local
        if self.positions:
            self.passed_step(first)
            assert isinstance(first, (plan.Number, plan.NumberBlock))
            self.line(self.position.text(-first.size), local)
        elif self.is_nanoseconds(type_):
            assert isinstance(type_, ir.Ref)
            fields = self.messages[type_.target].fields
            seconds, nanoseconds = (self.read(field.type) for field in fields)
            return f"{seconds} * 1000000000 + {nanoseconds}"
        elif isinstance(first, plan.NumbersStep):
            count = self.count(first.bound, first.place.path)
            start = self.pass_elements(count, first.unit, first.unit)
            self.view(local, first.info.dtype, count, start)
        elif isinstance(first, plan.NumberBlock) and first.primitive not in plan.LIST_PRIMITIVES:
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

    def make_nested(self, place: plan.Slot, type_: ir.TypeName) -> tuple[PlainStatement, ...]:
        """Return the statements that make a nested object."""
        made = PlainStatement(call(self.makers[type_]), place.local)
        return (made, PlainStatement(place.local, place.text)) if place.owner else (made,)

    def texts(self, step: plan.StringsStep) -> None:
        """Read strings one by one: the codec's own function remembers those of the last message."""
        count = self.begin(step)
        self.line("[]", step.place.text)

        def element() -> None:
            local = self.names.new("text")
            place = plan.Slot("", "", local, local, step.place.type)
            self.step(plan.StringStep(place, step.wide))
            self.line(call(f"{step.place.text}.append", local))

        self.repeat(count, element)

    def text(self, place: plan.Slot) -> str:
        """Read the size of a string; return the expression that reads the string."""
        self.number("size", place.path)
        start = self.start()
        self.line(f"{self.position.text(-1)} + size", "end")
        self.body.append(CompoundStatement("if data[end]:", UNENDED))
        self.position = Cursor("end", 1, multiple_of(1))
        return f'str(data{slice_of(start)}, "utf-8")'

    # Elements of arrays and sequences.

    def go_to(self, type_: ir.Array | ir.Sequence, index: int) -> None:
        """Go to an element of a list."""
        (step,) = self.steps(type_)
        if isinstance(type_, ir.Array):
            place = str(index % type_.size)
            self.flush()
        else:
            self.count(type_.bound, "count")
            place = str(index)
            least = index if index >= 0 else -index - 1
            absent = call("absent", str(self.number_of_path), "count", self.position.text(-4))
            self.body.append(
                CompoundStatement(f"if count <= {least}:", (PlainStatement(f"raise {absent}"),))
            )
            if index < 0:
                place = self.tables.local("index")
                self.line(f"count - {-index}", place)
        if repeat := _repeated(step):
            self.align(repeat.align)
        self.pass_elements_of(step, place, followed=True)

    def each(
        self, type_: ir.Array | ir.Sequence, parts: tuple[PathStep, ...], way: tuple[object, ...]
    ) -> str:
        """Read the value at a path of each structure of a list, into a list."""
        (step,) = self.steps(type_)
        assert isinstance(step, plan.StructuresStep)
        count, values = self.begin(step), self.tables.local("values")
        self.line("[]", values)

        def element() -> None:
            value = self.value(type_.element, parts, way)
            self.flush()
            self.line(call(f"{values}.append", value))

        self.repeat(count, element, plan.smallest(step.body))
        return values

    # What is passed over.

    def pass_steps(self, steps: Sequence[plan.Step]) -> None:
        """Go over values."""
        for step in steps:
            self.passed_step(step)

    def passed_step(self, step: plan.Step) -> None:
        """Go over one value, which is not judged."""
        match step:
            case plan.Number() | plan.Dummy() | plan.NumberBlock():
                self.flush()
                self.align(step.unit)
                self.position = self.position.skip(step.size)
            case plan.StringStep(_, wide):
                self.pass_text(wide)
            case plan.StringsStep(size=int(size)) | plan.StructuresStep(size=int(size)):
                self.flush()
                self.pass_elements_of(step, str(size))
            case plan.NumbersStep() | plan.Bytes() | plan.StringsStep() | plan.StructuresStep():
                self.pass_elements_of(step, self.count(None, "count"))

    def pass_elements_of(self, step: plan.Step, count: str, *, followed: bool = False) -> None:
        """Go over elements of a list, which are `followed` by others."""
        repeat = _repeated(step)
        if repeat is not None and (followed or repeat.stride == repeat.size):
            if count.isdigit():
                self.align(repeat.align)
                self.position = self.position.skip(repeat.stride * int(count))
            else:
                self.pass_elements(count, repeat.align, repeat.stride)
        elif isinstance(step, plan.StructuresStep):
            if texts := _texts_of(step.body):
                self.pass_texts(count if texts == 1 else f"{texts} * {count}")
            else:
                self.repeat(count, partial(self.pass_steps, step.body), plan.smallest(step.body))
        elif isinstance(step, plan.StringsStep) and step.wide:
            self.repeat(count, partial(self.pass_text, True))
        else:
            self.pass_texts(count)

    def pass_text(self, wide: bool) -> None:
        """Go over a string."""
        self.number("size", "size")
        self.line(f"{self.position.text()} + {'4 * ' * wide}size", "end")
        self.position = Cursor("end", 0, multiple_of(4 if wide else 1))

    def pass_texts(self, count: str) -> None:
        """Go over many strings."""
        self.align(4)
        self.line(call("pass_texts", "words", self.position.text(), count), "end")
        self.position = Cursor("end", 0, multiple_of(1))

    def repeat(self, count: str, emit: Callable[[], None], least: int = 0) -> None:
        """Emit a loop over elements of at least so many bytes, or what is in it for one."""

        def element() -> None:
            emit()
            self.flush()

        if least:
            self.short_if(f"{least} * {count} > limit")
        if count == "1":
            element()
        elif count != "0":
            self.loop(f"for _ in range({count}):", element)


def _is_numeric(type_: ir.FieldType) -> bool:
    return isinstance(type_, ir.Primitive) and type_.name not in plan.LIST_PRIMITIVES
