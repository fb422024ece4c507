"""Sensible values for the fields of messages, as Python source that spells every field out."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from idlc.model import ir, python_names
from idlc.scaffold.layout import call

WIDTH = 99
INDENTATION = "    "
#: Nested messages are spelled out as long as a message has at most so many values.
LEAVES = 16
_TIME = ir.TypeName("builtin_interfaces", "msg", "Time")
_QUATERNION = ir.TypeName("geometry_msgs", "msg", "Quaternion")
#: Values of string fields that mean the same in every message.
_STRINGS = {"frame_id": "base_link", "child_frame_id": "base_link", "data": "hello"}
#: Fields that hold one of the constants of their message.
_CHOICES = ("type", "state", "status", "mode", "kind", "level", "command", "action", "code")

Messages = Mapping[ir.TypeName, ir.Message]


class Page:
    """The interfaces that one module of Python imports, and their names in it.

    `clock` is the expression of the current time, where there is a clock. `taken` names are used
    otherwise. Comments are copied from interfaces of the package `own` only.
    """

    def __init__(
        self,
        messages: Messages,
        *,
        clock: str | None = None,
        taken: Iterable[str] = (),
        own: str = "",
    ) -> None:
        self.messages = messages
        self.clock = clock
        self.own = own
        self._names: dict[tuple[str, str], str] = {}
        self._taken = set(taken)

    def use(self, name: ir.TypeName) -> str:
        """Return the name of a class in this module, and import it."""
        base, part = _spoken(name)
        key = (f"{name.package}.{name.kind}", base)
        if key not in self._names:
            called = base if base not in self._taken else f"{name.package}_{name.kind}_{base}"
            self._names[key] = called
            self._taken.add(called)
        return self._names[key] + part

    @property
    def names(self) -> set[str]:
        """The names that are imported."""
        return set(self._names.values())

    def imports(self) -> dict[str, set[str]]:
        """Return the imported names by module."""
        imported: dict[str, set[str]] = {}
        for (module, base), called in self._names.items():
            what = base if called == base else f"{base} as {called}"
            imported.setdefault(module, set()).add(what)
        return imported


def _spoken(name: ir.TypeName) -> tuple[str, str]:
    """Return the interface's class, and the part of it that a section is."""
    base, _, part = name.name.rpartition("_")
    if name.kind != "msg" and base:
        return python_names.class_(name._replace(name=base)), f".{part}"
    return python_names.class_(name), ""


class Line(NamedTuple):
    """A line of source: how deep, and its text."""

    depth: int
    text: str

    def __str__(self) -> str:
        return INDENTATION * self.depth + self.text


def constructed(
    message: ir.Message,
    page: Page,
    *,
    head: str,
    depth: int,
    values: Mapping[str, str] | None = None,
) -> str:
    """Return the lines that make a message, after `head`, at a depth of indentation.

    `values` holds the values of fields that come from elsewhere.
    """
    lines = list(_construct(message, page, head, depth, "", values or {}))
    return "\n".join(map(str, lines)).lstrip()


def assigned(message: ir.Message, page: Page, variable: str, depth: int) -> list[str]:
    """Return the lines that give each field of a variable a value, with its documentation."""
    statements: list[str] = []
    for field in message.fields:
        head = f"{variable}.{python_names.field(field.name)} = "
        nested = _nested(field, page)
        if nested:
            lines = [*map(str, _construct(nested, page, head, 0, "", {}))]
        else:
            lines = [head + sample(message, field, page)]
        if all(len(line) + depth * len(INDENTATION) <= WIDTH for line in lines):
            statements += [*_documented(message, field, page, depth), *lines]
    return statements


def _construct(
    message: ir.Message, page: Page, head: str, depth: int, tail: str, values: Mapping[str, str]
) -> Iterator[Line]:
    name = page.use(message.name)
    inner = [
        line for field in message.fields for line in _field(message, field, page, depth + 1, values)
    ]
    if not inner:
        yield Line(depth, f"{head}{name}(){tail}")
        return
    yield Line(depth, f"{head}{name}(")
    yield from inner
    yield Line(depth, f"){tail}")


def _field(
    message: ir.Message, field: ir.Field, page: Page, depth: int, values: Mapping[str, str]
) -> Iterator[Line]:
    name = python_names.field(field.name)
    nested = _nested(field, page)
    if field.name in values:
        value = [Line(depth, f"{name}={values[field.name]},")]
    elif nested:
        value = list(_construct(nested, page, f"{name}=", depth, ",", {}))
    else:
        value = [Line(depth, f"{name}={sample(message, field, page)},")]
    if any(len(str(line)) > WIDTH for line in value):
        return
    if field.name not in values:
        yield from (Line(depth, text) for text in _documented(message, field, page, depth))
    yield from value


def _documented(message: ir.Message, field: ir.Field, page: Page, depth: int) -> list[str]:
    """Return the interface's comments on a field, in lines that fit."""
    if message.name.package != page.own:
        return []
    text = " ".join(filter(None, (clean(line) for line in field.comment)))
    unit = f"[{clean(field.unit)}]" if field.unit else ""
    words = " ".join(filter(None, (text, unit)))
    width = WIDTH - len(INDENTATION) * depth
    return textwrap.wrap(words, width, initial_indent="# ", subsequent_indent="# ")


def clean(text: str) -> str:
    """Return one line of text without anything that does not print."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def _nested(field: ir.Field, page: Page) -> ir.Message | None:
    """Return the message that a field is, if it is to be spelled out."""
    if not isinstance(field.type, ir.Ref) or (field.type.target == _TIME and page.clock):
        return None
    message = page.messages[field.type.target]
    return message if message.fields and _leaves(message, page.messages) <= LEAVES else None


def _leaves(message: ir.Message, messages: Messages) -> int:
    return sum(
        _leaves(messages[field.type.target], messages) if isinstance(field.type, ir.Ref) else 1
        for field in message.fields
    )


def sample(message: ir.Message, field: ir.Field, page: Page) -> str:
    """Return the source of a sensible value for a field."""
    if field.default is not None:
        return literal(field.type, field.default.value)
    constant = _choice(message, field)
    if constant is not None:
        return f"{page.use(message.name)}.{constant}"
    if message.name == _QUATERNION and field.name == "w":
        return "1.0"
    match field.type:
        case ir.Sequence():
            return "[]"
        case ir.Array(element, size):
            return _array(element, size, page)
        case ir.Ref(target) if target == _TIME and page.clock:
            return page.clock
    return _element(ir.element_of(field.type), page, field.name)


def _choice(message: ir.Message, field: ir.Field) -> str | None:
    """Return the first constant among the values of a field."""
    fitting = [constant.name for constant in message.constants if constant.type == field.type]
    prefixed = [name for name in fitting if name.startswith(field.name.upper() + "_")]
    if prefixed:
        return prefixed[0]
    chosen = fitting and field.name.rpartition("_")[2] in _CHOICES
    return fitting[0] if chosen else None


def _element(element: ir.Element, page: Page, name: str) -> str:
    match element:
        case ir.Ref(target):
            return f"{page.use(target)}()"
        case ir.String(bound=bound):
            text = _STRINGS.get(name, "")
            return repr(text if bound is None or len(text) <= bound else "")
        case ir.Primitive(kind):
            return literal(element, False if kind == "bool" else 0)
    return "None"


def _array(element: ir.Element, size: int, page: Page) -> str:
    item = _element(element, page, "")
    return (
        f"[{item} for _ in range({size})]" if isinstance(element, ir.Ref) else f"[{item}] * {size}"
    )


def literal(type_: ir.FieldType, value: ir.Value) -> str:
    """Return a value as Python source."""
    element = ir.element_of(type_)
    if isinstance(value, tuple):
        return "[" + ", ".join(literal(element, item) for item in value) + "]"
    if isinstance(element, ir.Primitive):
        if element.name == "byte":
            return repr(bytes([int(value)]))
        if element.name.startswith("float"):
            number = float(value)
            return repr(number) if number - number == 0 else f"float('{number}')"
    return repr(value)


#: Arguments that the parser has already.
_TAKEN = {"help", "server_timeout"}
HELP_WIDTH = 60


class RequestView(NamedTuple):
    """The function that makes a request or goal from the arguments of the command line."""

    function: str
    type: str
    what: str
    value: str


def request(message: ir.Message, page: Page, word: str, what: str, prefix: str) -> RequestView:
    """Return the function for one request."""
    values = {
        field.name: f"given.{_dest(field, prefix)}"
        for field in message.fields
        if _type(field) is not None
    }
    value = constructed(message, page, head="return ", depth=1, values=values)
    return RequestView(f"{word}_request", page.use(message.name), what, value)


def lines(message: ir.Message, page: Page, prefix: str, *, positional: bool) -> list[str]:
    """Return the lines that declare the arguments for a request's fields."""
    return [
        line
        for field in message.fields
        if (type_ := _type(field)) is not None
        for line in _argument(message, field, type_, page, prefix, positional)
    ]


def _argument(
    message: ir.Message, field: ir.Field, type_: str, page: Page, prefix: str, positional: bool
) -> list[str]:
    dest = _dest(field, prefix)
    simple = isinstance(field.type, (ir.Primitive, ir.String))
    option = "--" + dest.replace("_", "-")
    words = [repr(option)]
    if type_ == "bool":
        words.append("action=argparse.BooleanOptionalAction")
    elif positional and simple:
        words = [repr(dest), f"type={type_}", "nargs='?'"]
    else:
        words.append(f"type={type_}")
        if isinstance(field.type, ir.Array):
            words.append(f"nargs={field.type.size}")
        elif not simple:
            words.append("nargs='*'")
    words.append(f"default={sample(message, field, page)}")
    text = textwrap.shorten(_help(field), HELP_WIDTH, placeholder=" ...")
    words.append(f"help={text.replace('%', '%%')!r}")
    return call("parser.add_argument", words, depth=1)


def _help(field: ir.Field) -> str:
    text = " ".join(filter(None, map(clean, field.comment))) or field.name.replace("_", " ")
    return f"{text} [{clean(field.unit)}]" if field.unit else text


def _dest(field: ir.Field, prefix: str) -> str:
    name = python_names.field(f"{prefix}{field.name}")
    return f"{name}_" if name in _TAKEN else name


def _type(field: ir.Field) -> str | None:
    """Return the type of a field's values on the command line; `None` if it has none."""
    match ir.element_of(field.type):
        case ir.String():
            return "str"
        case ir.Primitive("bool"):
            return "bool" if isinstance(field.type, ir.Primitive) else None
        case ir.Primitive("byte"):
            return None
        case ir.Primitive(name):
            return "float" if name.startswith("float") else "int"
    return None
