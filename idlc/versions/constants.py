"""Renumbered constants: the fields whose recorded values have another meaning now."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from idlc.model import ir
from idlc.model.enums import enums, holds_integers
from idlc.model.ir import spell_value
from idlc.model.python_names import field as attribute


class Renumbering(NamedTuple):
    """The constants of a field whose values changed, in both versions.

    `old` and `new` are texts such as `OPEN=0, CLOSED=1`. `proposal` is the expression of a rule,
    empty if one old value has several new ones.
    """

    old: str
    new: str
    constants: tuple[str, ...]
    proposal: str

    @property
    def reason(self) -> str:
        """The change as a part of a sentence."""
        return f"constants changed from {self.old} to {self.new}"


def renumbered(old: ir.Message, new: ir.Message) -> dict[str, Renumbering]:
    """Return the renumbered constants by the field of both versions that they are values of.

    A constant belongs to the field of its enum, or else to the next field of its type.
    """
    later = {constant.name: constant for constant in new.constants}
    pairs = [
        (constant, later[constant.name]) for constant in old.constants if constant.name in later
    ]
    groups: dict[str, list[tuple[ir.Constant, ir.Constant]]] = {}
    for before, after in pairs:
        field = _field_of(after, new, {field.name for field in old.fields})
        if field is not None:
            groups.setdefault(field.name, []).append((before, after))
    types = {field.name: field.type for field in new.fields}
    return {
        name: _renumbering(name, types[name], group)
        for name, group in groups.items()
        if any(before.value != after.value for before, after in group)
    }


def _field_of(constant: ir.Constant, message: ir.Message, names: set[str]) -> ir.Field | None:
    """Return the field that a constant is a value of, if one of these names is."""
    if not (isinstance(constant.type, ir.String) or holds_integers(constant.type)):
        return None
    fields = [field for field in message.fields if field.name in names]
    for enum in enums(message, "all"):
        if constant in enum.members.values():
            return next((field for field in enum.fields if field in fields), None)
    fields = [field for field in fields if _is_of(ir.element_of(field.type), constant.type)]
    following = [field for field in fields if _is_after(field, constant)]
    return next(iter([*following, *reversed(fields)]), None)


def _is_of(element: ir.Element, type_: ir.Primitive | ir.String) -> bool:
    return isinstance(element, ir.String) if isinstance(type_, ir.String) else element == type_


def _is_after(field: ir.Field, constant: ir.Constant) -> bool:
    spans = field.name_span, constant.name_span
    return spans[0] is None or spans[1] is None or spans[0].start > spans[1].start


def _renumbering(
    name: str, type_: ir.FieldType, group: Iterable[tuple[ir.Constant, ir.Constant]]
) -> Renumbering:
    pairs = list(group)
    changed = [pair for pair in pairs if pair[0].value != pair[1].value]
    old, new = (
        ", ".join(f"{pair[side].name}={spell_value(pair[side].value)}" for pair in changed)
        for side in (0, 1)
    )
    values: dict[object, set[object]] = {}
    for before, after in pairs:
        values.setdefault(before.value, set()).add(after.value)
    proposal = ""
    if all(len(new) == 1 for new in values.values()):
        mapping = {before.value: after.value for before, after in changed}
        value = f"old.{attribute(name)}"
        if isinstance(type_, (ir.Array, ir.Sequence)):
            proposal = f"[{mapping!r}.get(value, value) for value in {value}]"
        else:
            proposal = f"{mapping!r}.get({value}, {value})"
    return Renumbering(old, new, tuple(before.name for before, _ in changed), proposal)
