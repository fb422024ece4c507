"""Factors between units, which rules for changed units are proposed from."""

from __future__ import annotations

import re
from fractions import Fraction
from math import pi

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
