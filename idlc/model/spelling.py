"""IR types and values as one writes them in an interface file."""

from __future__ import annotations

import re

from idlc.model import ir

_NUMBER = r"[+-]?(?:\d+(?:\.\d+)?(?:[eE][+-]?\d+)?|\d*(?:pi|π)(?:/\d+)?|inf|∞)%?"
_RANGE = re.compile(
    rf"\s*(?:{_NUMBER}\s*(?:\.\.\.?|…|-|\u2013|to)\s*{_NUMBER}|(?:[<>]=?|≤|≥)\s*{_NUMBER})\s*"
)


def spell(type_: ir.FieldType, package: str = "") -> str:
    """Return a type as written in a file of `package`, such as `string<=10[<=3]`."""
    match type_:
        case ir.Array():
            return f"{spell(type_.element, package)}[{type_.size}]"
        case ir.Sequence():
            bound = "" if type_.bound is None else f"<={type_.bound}"
            return f"{spell(type_.element, package)}[{bound}]"
        case ir.Primitive():
            return type_.name
        case ir.String():
            bound = "" if type_.bound is None else f"<={type_.bound}"
            return f"{'w' * type_.wide}string{bound}"
        case ir.Ref():
            name = type_.target
            return name.name if name.package == package else f"{name.package}/{name.name}"
        case ir.Unknown():
            return "?"


def spell_value(value: ir.Value) -> str:
    """Return a value as a person would write it."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(spell_value, value))}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value)


def is_range(unit: str) -> bool:
    """Return whether the text in the brackets of a comment is a range, and no unit."""
    return _RANGE.fullmatch(unit) is not None
