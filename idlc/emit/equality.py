"""What `==` compares: field by field as rosidl does, and what costs least first."""

from __future__ import annotations

import msgspec

from idlc.emit import pynames
from idlc.emit.python_lines import WIDTH, Group, Node, all_of, any_of, call, lines
from idlc.emit.references import References
from idlc.model import ir


class Equality(msgspec.Struct, frozen=True):
    """Conditions under each of which two messages differ, and the expression of what is left.

    That is True or False, also where fields hold numpy's scalars.
    """

    differences: tuple[str, ...]
    rest: str


def equality(structure: ir.Message, receiver: str, references: References) -> Equality:
    """Return how `receiver` and `other` are compared."""
    scalars = [field for field in structure.fields if _is_scalar(field, receiver)]
    others = [field for field in structure.fields if field not in scalars]
    if not others:
        return Equality((), _all_equal(scalars, receiver))
    parts = [_compared(field, receiver, references) for field in others]
    calls: list[Node] = [part for part in parts if isinstance(part, Group)]
    plain = [part for part in parts if isinstance(part, str)]
    if plain and all(_is_foreign(field, references) for field in others):
        # another package's class may have no types
        calls += plain[:-1]
        last = lines(call("bool", plain[-1]), 8, "return ")
    else:
        last = all_of(plain, 8) if plain else lines(calls.pop(), 8, "return ")
    differences = [_operator(field, receiver, "!=") for field in scalars]
    differences += [_between(lines(part, 8, "if not ", ":"), "if ", ":") for part in calls]
    return Equality(tuple(differences), _between(last, "return ", ""))


def _between(statement: list[str], before: str, after: str) -> str:
    return "\n".join(statement).strip().removeprefix(before).removesuffix(after)


def _is_foreign(field: ir.Field, references: References) -> bool:
    """Return whether what two values are compared by may be of another package."""
    element = ir.element_of(field.type)
    return not isinstance(element, ir.Ref) or element.target.package != references.package


def _is_scalar(field: ir.Field, receiver: str) -> bool:
    scalar = isinstance(field.type, (ir.Primitive, ir.String))
    return scalar and len(_operator(field, receiver, "==")) <= WIDTH - 16


def _operator(field: ir.Field, receiver: str, operator: str) -> str:
    slot = pynames.slot(field.name)
    return f"{receiver}.{slot} {operator} other.{slot}"


def _compared(field: ir.Field, receiver: str, references: References) -> str | Group:
    """Return whether a field is equal.

    It is a call for what may be an array, what has no type, and what is too long for a line.
    """
    plain = _operator(field, receiver, "==")
    element = ir.element_of(field.type)
    is_array = isinstance(field.type, (ir.Array, ir.Sequence)) and isinstance(element, ir.Primitive)
    untyped = isinstance(element, ir.Ref) and element.target in references.implied
    if is_array or untyped or len(plain) > WIDTH - 16:
        slot = pynames.slot(field.name)
        return call("_idlc.same", f"{receiver}.{slot}", f"other.{slot}")
    return plain


def _all_equal(scalars: list[ir.Field], receiver: str) -> str:
    """Return the expression for messages of nothing but numbers and texts.

    What `!=` returns is only tested: that is faster than to make a bool of it.
    """
    if not scalars:
        return "True"
    if len(scalars) == 1:
        return _between(lines(call("bool", _operator(scalars[0], receiver, "==")), 8), "", "")
    conditions = [_operator(field, receiver, "!=") for field in scalars]
    return _between(any_of(conditions, 8, "return not (", ")"), "return ", "")
