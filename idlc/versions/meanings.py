"""Changed meanings: factors between units, and constants that were renumbered."""

from __future__ import annotations

import re
from collections.abc import Iterable
from fractions import Fraction
from math import pi
from typing import NamedTuple

from idlc.model import ir
from idlc.model.enums import enums, holds_integers
from idlc.model.ir import spell_value
from idlc.model.python_names import field as attribute

#: The size of each unit, in the unit that begins its line.
_SIZES: dict[str, dict[str, str]] = {
    "rad": {"rad": "1", "deg": "pi/180", "°": "pi/180", "degree": "pi/180", "degrees": "pi/180"},
    "m": {"m": "1", "km": "1000", "dm": "1/10", "cm": "1/100", "mm": "1/1000", "um": "1/1000000"},
    "s": {
        "s": "1",
        "sec": "1",
        "ms": "1/1000",
        "us": "1/1000000",
        "ns": "1/1000000000",
        "min": "60",
        "h": "3600",
    },
    "kg": {"kg": "1", "g": "1/1000", "t": "1000"},
    "N": {"N": "1", "kN": "1000", "mN": "1/1000"},
    "V": {"V": "1", "mV": "1/1000", "kV": "1000"},
    "A": {"A": "1", "mA": "1/1000"},
    "W": {"W": "1", "mW": "1/1000", "kW": "1000"},
    "Pa": {"Pa": "1", "hPa": "100", "kPa": "1000", "bar": "100000", "mbar": "100"},
    "Hz": {"Hz": "1", "kHz": "1000", "MHz": "1000000"},
    "Ah": {"Ah": "1", "mAh": "1/1000"},
    "1": {"%": "1/100", "percent": "1/100"},
}
_BY_UNIT = {
    unit: (base, Fraction(size.replace("pi", "1")), int("pi" in size))
    for base, units in _SIZES.items()
    for unit, size in units.items()
}
#: A part of a unit: its name, and its power.
_PART = re.compile(r"([^\s^*/·²³0-9]+)(?:\^?([0-9])|([²³]))?")
_CELSIUS, _KELVIN = {"degC", "°C", "C", "celsius"}, {"K", "kelvin"}


def factor(old: str, new: str) -> str:
    """Return the expression of a value `{}` in a new unit, empty if the units do not say it."""
    if old in _CELSIUS and new in _KELVIN:
        return "{} + 273.15"
    if old in _KELVIN and new in _CELSIUS:
        return "{} - 273.15"
    sizes = [_size(unit) for unit in (old, new)]
    if sizes[0] is None or sizes[1] is None or sizes[0][0] != sizes[1][0]:
        return ""
    ratio, powers = sizes[0][1] / sizes[1][1], sizes[0][2] - sizes[1][2]
    if powers:
        return f"{{}} * {float(ratio) * pi**powers!r}"
    if ratio.denominator != 1:
        divides = ratio.numerator == 1
        return f"{{}} / {ratio.denominator}" if divides else f"{{}} * {float(ratio)!r}"
    return f"{{}} * {ratio.numerator}" if ratio != 1 else "{}"


def _size(unit: str) -> tuple[tuple[tuple[str, int], ...], Fraction, int] | None:
    """Return the dimensions of a unit, its size, and the power of pi that belongs to it."""
    dimensions: dict[str, int] = {}
    size, powers = Fraction(1), 0
    above, *below = unit.split("/")
    if len(below) > 1:
        return None
    for sign, part in ((1, above), (-1, "".join(below))):
        rest = _PART.sub("", part)
        if rest.strip(" *·1"):
            return None
        for name, digit, mark in _PART.findall(part):
            if name not in _BY_UNIT:
                return None
            base, own, of_pi = _BY_UNIT[name]
            power = sign * int(digit or {"": 1, "²": 2, "³": 3}[mark])
            dimensions[base] = dimensions.get(base, 0) + power
            size, powers = size * own**power, powers + of_pi * power
    kept = tuple(sorted((base, power) for base, power in dimensions.items() if power))
    return (kept, size, powers) if kept else None


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
