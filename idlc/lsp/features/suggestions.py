"""Texts that fit a place: bounds, names, values and units."""

from __future__ import annotations

from collections.abc import Iterator

from idlc.checks.units import QUANTITIES, expected
from idlc.model import ir, names
from idlc.model.lowering.types import STRINGS
from idlc.syntax import tree
from idlc.syntax.parse import parse_definition

#: Numbers that people take for bounds.
BOUNDS = ("1", "3", "6", "9", "16", "32", "36", "64", "128", "256", "1024")

#: Elements of the longest array of which a value is offered.
MOST_ELEMENTS = 36


def field_name(type_: str) -> str:
    """Return what a field that holds a message is called first."""
    return names.snake_case(type_.rpartition("/")[2].partition("[")[0])


def values(type_: str) -> Iterator[str]:
    """Yield values for a type as it is written; none for a message."""
    base, bracket, length = type_.partition("[")
    base = base.partition("<=")[0]
    if bracket:
        size = length.removesuffix("]")
        if base not in ir.PRIMITIVES and base not in STRINGS:
            return
        if not size.isdecimal():
            yield "[]"
        elif len(size) <= len(str(MOST_ELEMENTS)) and 0 < int(size) <= MOST_ELEMENTS:
            yield f"[{', '.join([next(values(base))] * int(size))}]"
    elif base == "bool":
        yield from ("true", "false")
    elif base in STRINGS:
        yield '""'
    elif base in ir.PRIMITIVES:
        info = ir.PRIMITIVES[base]
        if info.low is None:
            yield from ("0.0", "1.0", "nan", "inf")
        else:
            yield from dict.fromkeys(map(str, (0, 1, info.low, info.high)))


def constants(lines: list[str], line: int, type_: str) -> Iterator[tuple[str, str]]:
    """Yield name and value of the constants of a type in the section around a line."""
    before = [number for number in range(line) if lines[number].rstrip("\r\n") == "---"]
    start = before[-1] + 1 if before else 0
    for text in lines[start:]:
        if text.rstrip("\r\n") == "---":
            return
        code = text.partition("#")[0].replace("\t", " ").rstrip()
        body = parse_definition(code) if "=" in code else None
        if isinstance(body, tree.Constant) and body.type.whole.text == type_ and body.value.text:
            yield body.name.text, body.value.text


def units_for(name: str) -> tuple[str, ...]:
    """Return units, first the one that a field's name asks for."""
    own = expected(name)
    return tuple(dict.fromkeys((*([own] if own else []), *sorted(set(QUANTITIES.values())))))
