"""Sensible values for the fields of messages, as Python source that spells every field out."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from idlc.generate.templates import Code, EscapedText
from idlc.model import ir, python_names
from idlc.wire.layout import Messages

#: The width of comments, which may be indented far.
COMMENT = 64
#: Longer defaults are left to the class of the message.
LONG_TEXT = 40
#: Nested messages are spelled out as long as a message has at most so many values.
LEAVES = 16
_TIME = ir.TypeName("builtin_interfaces", "msg", "Time")
_QUATERNION = ir.TypeName("geometry_msgs", "msg", "Quaternion")
#: Values of string fields that mean the same in every message.
_STRINGS = {"frame_id": "base_link", "child_frame_id": "base_link", "data": "hello"}
#: Fields that hold one of the constants of their message.
_CHOICES = ("type", "state", "status", "mode", "kind", "level", "command", "action", "code")


class Page:
    """The interfaces that one module of Python imports, and their names in it.

    `clock` is the expression of the current time, where there is a clock. `taken` names are used
    otherwise, or imported. Comments are copied from interfaces of the package `own` only.
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
        self.taken = set(taken)

    def use(self, name: ir.TypeName) -> str:
        """Return the name of a class in this module, and import it."""
        outer, _, part = name.name.rpartition("_")
        is_part = name.kind != "msg" and outer != ""
        base = python_names.class_(name._replace(name=outer) if is_part else name)
        key = (f"{name.package}.{name.kind}", base)
        if key not in self._names:
            called = base if base not in self.taken else f"{name.package}_{name.kind}_{base}"
            self._names[key] = called
            self.taken.add(called)
        return f"{self._names[key]}.{part}" if is_part else self._names[key]

    def imports(self) -> dict[str, set[str]]:
        """Return the imported names by module."""
        imported: dict[str, set[str]] = {}
        for (module, base), called in self._names.items():
            what = base if called == base else f"{base} as {called}"
            imported.setdefault(module, set()).add(what)
        return imported


class FieldSample(NamedTuple):
    """A field with a sensible value: source, or a message that is spelled out."""

    name: Code
    comment: tuple[EscapedText, ...]
    value: Code
    message: SampleMessage | None = None


class SampleMessage(NamedTuple):
    """A message whose fields have sensible values; `type` is its class in the module."""

    type: Code
    fields: tuple[FieldSample, ...]


def sample(
    message: ir.Message, page: Page, values: Mapping[str, str] = MappingProxyType({})
) -> SampleMessage:
    """Return a message with a value for each field.

    `values` are those of fields that come from elsewhere. A field with a long default keeps it.
    """
    fields = []
    for field in message.fields:
        name = Code(python_names.field(field.name))
        meaning = _meaning(field) if message.name.package == page.own else ""
        comment = tuple(map(EscapedText, textwrap.wrap(meaning, COMMENT)))
        nested = _nested(field, page)
        if field.name in values:
            fields.append(FieldSample(name, (), Code(values[field.name])))
        elif nested:
            fields.append(FieldSample(name, comment, Code(), sample(nested, page)))
        elif not _has_long_default(field):
            fields.append(FieldSample(name, comment, Code(field_value(message, field, page))))
    return SampleMessage(Code(page.use(message.name)), tuple(fields))


def _has_long_default(field: ir.Field) -> bool:
    value = field.default.value if field.default else ()
    items = value if isinstance(value, tuple) else (value,)
    return len(items) > LEAVES or any(len(str(item)) > LONG_TEXT for item in items)


def logged(message: ir.Message, variable: str) -> Code:
    """Return the replacement field of an f-string that shows a message, or a short field of it."""
    short = [f for f in message.fields if isinstance(f.type, (ir.Primitive, ir.String))]
    if short and (len(short) == 1 or len(short) < len(message.fields)):
        return Code(f"{{{variable}.{python_names.field(short[0].name)}=}}")
    return Code(f"{{{variable}=}}")


def _meaning(field: ir.Field, fallback: str = "") -> str:
    """Return the comment on a field, or other words, and its unit."""
    text = " ".join(filter(None, map(clean, field.comment))) or fallback
    return " ".join(filter(None, (text, f"[{clean(field.unit)}]" if field.unit else "")))


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


def field_value(message: ir.Message, field: ir.Field, page: Page) -> str:
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
            item = _element(element, page, "")
            is_message = isinstance(element, ir.Ref)
            return f"[{item} for _ in range({size})]" if is_message else f"[{item}] * {size}"
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


class Argument(NamedTuple):
    """An argument of the command line: its name, and how argparse reads it."""

    name: Code
    words: tuple[Code, ...]


def request(
    message: ir.Message, page: Page, prefix: str, *, positional: bool
) -> tuple[SampleMessage, tuple[Argument, ...]]:
    """Return a request whose fields come from the command line, and its arguments there."""
    values, arguments = {}, []
    for field in message.fields:
        type_ = _type(field)
        if type_ is None:
            continue
        destination: str = python_names.field(f"{prefix}{field.name}")
        destination += "_" * (destination in _TAKEN)
        values[field.name] = f"options.{destination}"
        name, words = "--" + destination.replace("_", "-"), [f"type={type_}"]
        if type_ == "bool":
            words = ["action=argparse.BooleanOptionalAction"]
        elif isinstance(field.type, ir.Array):
            words.append(f"nargs={field.type.size}")
        elif not isinstance(field.type, (ir.Primitive, ir.String)):
            words.append("nargs='*'")
        elif positional:
            name = destination
            words.append("nargs='?'")
        text = _meaning(field, field.name.replace("_", " "))
        text = textwrap.shorten(text, HELP_WIDTH, placeholder=" ...").replace("%", "%%")
        words += [f"default={field_value(message, field, page)}", f"help={text!r}"]
        arguments.append(Argument(Code(repr(name)), tuple(map(Code, words))))
    return sample(message, page, values), tuple(arguments)


def _type(field: ir.Field) -> str | None:
    """Return the type of a field's values on the command line; `None` if it has none."""
    if _has_long_default(field):
        return None
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
