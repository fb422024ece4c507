"""Units of physical quantities: which names ask for one, and which units REP 103 does not have."""

from __future__ import annotations

import re
from itertools import islice

from idlc.model import ir
from idlc.model.lowering.comments import brackets

# the lengths are bounded, or a long comment without an end would take for ever
REMARK = re.compile(r"idlc:\s{0,20}ignore\[[^\]]{0,200}\]")

#: Words of a field's name that ask for a unit, and the unit.
QUANTITIES = {
    "acceleration": "m/s^2",
    "altitude": "m",
    "angle": "rad",
    "current": "A",
    "depth": "m",
    "distance": "m",
    "duration": "s",
    "energy": "J",
    "force": "N",
    "frequency": "Hz",
    "height": "m",
    "humidity": "%",
    "length": "m",
    "mass": "kg",
    "pitch": "rad",
    "power": "W",
    "pressure": "Pa",
    "radius": "m",
    "roll": "rad",
    "speed": "m/s",
    "temperature": "degC",
    "timeout": "s",
    "torque": "N m",
    "velocity": "m/s",
    "voltage": "V",
    "weight": "kg",
    "width": "m",
    "yaw": "rad",
}

#: Units that are not those of REP 103, and those that are.
_USUAL = {
    "bar": "Pa",
    "cm": "m",
    "deg": "rad",
    "degree": "rad",
    "degrees": "rad",
    "deg/s": "rad/s",
    "feet": "m",
    "foot": "m",
    "ft": "m",
    "g": "kg",
    "gram": "kg",
    "grams": "kg",
    "h": "s",
    "hour": "s",
    "hours": "s",
    "inch": "m",
    "inches": "m",
    "km": "m",
    "km/h": "m/s",
    "kmh": "m/s",
    "knots": "m/s",
    "kph": "m/s",
    "mbar": "Pa",
    "mile": "m",
    "miles": "m",
    "millimeter": "m",
    "millimeters": "m",
    "min": "s",
    "minutes": "s",
    "mm": "m",
    "mm/s": "m/s",
    "mph": "m/s",
    "ms": "s",
    "msec": "s",
    "ns": "s",
    "psi": "Pa",
    "rpm": "rad/s",
    "us": "s",
    "°": "rad",
    "°/s": "rad/s",
    "µs": "s",
}


#: Words of names of places on the earth, which are in degrees, as in sensor_msgs/NavSatFix.
_ON_EARTH = frozenset(("lat", "latitude", "lon", "long", "longitude"))


def expected(name: str) -> str | None:
    """Return the unit that a field of this name should have, `None` if it is no quantity."""
    words = name.split("_")
    if words[-1] in (
        "covariance",
        "ratio",
        "factor",
        "scale",
        "percentage",
        "index",
        "count",
        "id",
        "gain",
    ):
        return None
    found = next((QUANTITIES[word] for word in reversed(words) if word in QUANTITIES), None)
    if found == "m/s" and "angular" in words:
        return "rad/s"
    return "rad/s^2" if found == "m/s^2" and "angular" in words else found


def unit_of(field: ir.Field) -> str | None:
    """Return a field's unit as its writer meant it.

    The brackets of `# idlc: ignore[IDL405]` hide it from ROS 2, or are taken for it.
    """
    if field.unit is not None and not field.unit.startswith("IDL"):
        return field.unit
    pairs = brackets(REMARK.sub("", "\n".join(field.comment)))
    found = [inside for _, inside in islice(pairs, 2)]
    return found[0] if len(found) == 1 else None


def is_known_by(name: str, unit: str) -> bool:
    """Return whether a field's name says its unit, or is of what has that unit in ROS as well."""
    words = name.split("_")
    if unit in words or re.sub(r"\W", "_", unit) in name:
        return True
    return usual(unit) == "rad" and not _ON_EARTH.isdisjoint(words)


def is_unit(text: str) -> bool:
    """Return whether a text is a unit that one meets, of REP 103 or not."""
    known = {*QUANTITIES.values(), *_USUAL, *_USUAL.values(), "rad/s^2", "m^2", "m^3", "T", "lx"}
    return text in known


def usual(unit: str) -> str | None:
    """Return the unit of REP 103 for one that is not of it, `None` for any other text."""
    text = re.sub(r"\s+", "", unit)
    return _USUAL.get(text) or _USUAL.get(text.lower() if len(text) > 2 else text)
