"""The `__eq__` of a message class: field by field, as rosidl compares."""

from __future__ import annotations

from idlc.emit import fields, pynames
from idlc.emit.python_lines import WIDTH, Group, all_of, any_of, call, lines
from idlc.emit.references import References
from idlc.model import ir


def equality(structure: ir.Message, receiver: str, references: References) -> list[str]:
    """Return the method; it returns True or False, also where fields hold numpy's scalars."""
    boolean = "_builtins.bool" if fields.shadows(structure) else "bool"
    head = [
        f"    def __eq__({receiver}, other: _idlc.Any) -> {boolean}:",
        f"        if not isinstance(other, {references.name(structure.name)}):",
        "            return NotImplemented",
    ]
    scalars = [field for field in structure.fields if _is_short_scalar(field, receiver)]
    others = [field for field in structure.fields if field not in scalars]
    if not others:
        return [*head, *_scalars(scalars, receiver)]
    if scalars:
        differences = [_compared(field, receiver, "!=") for field in scalars]
        head += [*any_of(differences, 8, "if ", ":"), "            return False"]
    parts = [fields.comparison(field, receiver, references) for field in others]
    calls: list[str | Group] = [part for part in parts if isinstance(part, Group)]
    plain = [part for part in parts if isinstance(part, str)]
    if plain and all(_is_foreign(field, references) for field in others):
        # another package's class may have no types
        calls += plain[:-1]
        last = lines(call("bool", plain[-1]), 8, "return ")
    else:
        last = all_of(plain, 8) if plain else lines(calls.pop(), 8, "return ")
    for part in calls:
        head += [*lines(part, 8, "if not ", ":"), "            return False"]
    return [*head, *last]


def _is_foreign(field: ir.Field, references: References) -> bool:
    """Return whether what two values are compared by may be of another package."""
    element = ir.element_of(field.type)
    return not isinstance(element, ir.Ref) or element.target.package != references.package


def _is_short_scalar(field: ir.Field, receiver: str) -> bool:
    scalar = isinstance(field.type, (ir.Primitive, ir.String))
    return scalar and len(_compared(field, receiver, "==")) <= WIDTH - 16


def _compared(field: ir.Field, receiver: str, operator: str) -> str:
    slot = pynames.slot(field.name)
    return f"{receiver}.{slot} {operator} other.{slot}"


def _scalars(scalars: list[ir.Field], receiver: str) -> list[str]:
    """Return the lines that compare a message of nothing but numbers and texts.

    What `!=` returns is only tested: that is faster than to make a bool of it.
    """
    if not scalars:
        return ["        return True"]
    if len(scalars) == 1:
        return lines(call("bool", _compared(scalars[0], receiver, "==")), 8, "return ")
    return any_of([_compared(field, receiver, "!=") for field in scalars], 8, "return not (", ")")
