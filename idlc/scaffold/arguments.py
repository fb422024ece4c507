"""The command line of nodes that call services or send goals: a word for each field."""

from __future__ import annotations

import textwrap
from typing import NamedTuple

from idlc.emit import pynames
from idlc.model import ir
from idlc.scaffold.line_breaks import call
from idlc.scaffold.samples import Page, clean, constructed, sample

#: What the parser has already.
_TAKEN = {"help", "server_timeout"}
HELP_WIDTH = 60


class RequestView(NamedTuple):
    """The function that makes a request or goal of what the command line says."""

    function: str
    type: str
    what: str
    value: str


def request(message: ir.Message, page: Page, word: str, what: str, prefix: str) -> RequestView:
    """Return the function for one request."""
    given = {
        field.name: f"given.{_dest(field, prefix)}"
        for field in message.fields
        if _type(field) is not None
    }
    value = constructed(message, page, head="return ", depth=1, given=given)
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
    name = pynames.field(f"{prefix}{field.name}")
    return f"{name}_" if name in _TAKEN else name


def _type(field: ir.Field) -> str | None:
    """Return the type of a field's values on the command line; `None` where it has no place."""
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
