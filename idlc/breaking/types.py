"""How two types of one field differ."""

from __future__ import annotations

from idlc.model import ir
from idlc.model.describe import individual


def described(field: ir.Field) -> object:
    """Return what the type hash sees of a field's type."""
    message = ir.Message(name=ir.TypeName("", "msg", ""), fields=(field,))
    return individual(message)["fields"][0]["type"]


def without_bounds(type_: ir.FieldType) -> ir.FieldType:
    """Return a type that is equal for types which differ in sizes and bounds only."""
    match type_:
        case ir.String():
            return ir.String(type_.wide)
        case ir.Sequence():
            return ir.Sequence(_element_without_bounds(type_.element))
        case ir.Array():
            return ir.Array(_element_without_bounds(type_.element), 1)
        case _:
            return type_


def _element_without_bounds(element: ir.Element) -> ir.Element:
    return ir.String(element.wide) if isinstance(element, ir.String) else element


def container(type_: ir.FieldType) -> tuple[str, int | None]:
    """Return what C++ has a type of its own for: sizes and bounds of arrays, not of strings."""
    match type_:
        case ir.Sequence():
            return "sequence", type_.bound
        case ir.Array():
            return "array", type_.size
        case _:
            return "", None


def native(type_: ir.FieldType) -> object:
    """Return a value that is equal for types that are one type in C++ and in Python."""
    element = ir.element_of(type_)
    if element == ir.Primitive("char"):
        element = ir.Primitive("uint8")
    return container(type_), _element_without_bounds(element)


def tighter(old: ir.FieldType, new: ir.FieldType) -> bool:
    """Return whether text that was allowed is too long now."""
    before, after = ir.element_of(old), ir.element_of(new)
    if not isinstance(before, ir.String) or not isinstance(after, ir.String):
        return False
    return after.bound is not None and (before.bound is None or after.bound < before.bound)
