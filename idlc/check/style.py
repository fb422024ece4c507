"""Rules on names, comments and units, which do not affect the meaning of a file."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, first_few
from idlc.diagnostics.source import Span
from idlc.model import derive, enums, ir
from idlc.model.comments import brackets
from idlc.model.link import Model, own_fields, own_sections

# the lengths are bounded, or a long comment without an end would take for ever
REMARK = re.compile(r"idlc:\s{0,20}ignore\[[^\]]{0,200}\]")


def _by_word(units: Mapping[str, str]) -> dict[str, str]:
    return {word: unit for unit, words in units.items() for word in words.split()}


#: Words of a field's name that ask for a unit, and the unit.
QUANTITIES = _by_word(
    {
        "m": "altitude depth distance height length radius width",
        "rad": "angle pitch roll yaw",
        "s": "duration timeout",
        "m/s": "speed velocity",
        "m/s^2": "acceleration",
        "kg": "mass weight",
        "N": "force",
        "N m": "torque",
        "Pa": "pressure",
        "J": "energy",
        "W": "power",
        "A": "current",
        "V": "voltage",
        "Hz": "frequency",
        "degC": "temperature",
        "%": "humidity",
    }
)

#: Unusual units, and their replacements in REP 103.
_USUAL = _by_word(
    {
        "m": "cm feet foot ft inch inches km mile miles millimeter millimeters mm",
        "rad": "deg degree degrees °",
        "s": "h hour hours min minutes ms msec ns us µs",
        "m/s": "km/h kmh knots kph mm/s mph",
        "rad/s": "deg/s rpm °/s",
        "kg": "g gram grams",
        "Pa": "bar mbar psi",
    }
)


#: Last words of names that are no quantities.
_WITHOUT_UNIT = frozenset("covariance ratio factor scale percentage index count id gain".split())
#: Words for positions on the earth, which are in degrees, as in sensor_msgs/NavSatFix.
_ON_EARTH = frozenset(("lat", "latitude", "lon", "long", "longitude"))


def expects_unit(name: str) -> str | None:
    """Return the unit that a field of this name should have, `None` if it is no quantity."""
    words = name.split("_")
    if words[-1] in _WITHOUT_UNIT:
        return None
    unit = next((QUANTITIES[word] for word in reversed(words) if word in QUANTITIES), None)
    if unit == "m/s" and "angular" in words:
        return "rad/s"
    return "rad/s^2" if unit == "m/s^2" and "angular" in words else unit


def unit_of(field: ir.Field) -> str | None:
    """Return a field's unit as its author intended it.

    The brackets of `# idlc: ignore[IDL405]` hide it from ROS 2, or ROS 2 takes them for it.
    """
    if field.unit is not None and not field.unit.startswith("IDL"):
        return field.unit
    pairs = brackets(REMARK.sub("", "\n".join(field.comment)))
    units = [inside for _, inside in islice(pairs, 2)]
    return units[0] if len(units) == 1 else None


def is_known_by(name: str, unit: str) -> bool:
    """Return whether a field's name has its unit, or is a quantity that ROS itself has in it."""
    words = name.split("_")
    if unit in words or re.sub(r"\W", "_", unit) in name:
        return True
    return usual_unit(unit) == "rad" and not _ON_EARTH.isdisjoint(words)


def is_unit(text: str) -> bool:
    """Return whether a text is a common unit, of REP 103 or not."""
    units = {*QUANTITIES.values(), *_USUAL, *_USUAL.values(), "rad/s^2", "m^2", "m^3", "T", "lx"}
    return text in units


def usual_unit(unit: str) -> str | None:
    """Return the unit of REP 103 for an unusual one, `None` for any other text."""
    text = re.sub(r"\s+", "", unit)
    return _USUAL.get(text) or _USUAL.get(text.lower() if len(text) > 2 else text)


HEADER = ir.Ref(ir.TypeName("std_msgs", "msg", "Header"))
TIME = ir.Ref(ir.TypeName("builtin_interfaces", "msg", "Time"))
_SUFFIXES = {"msg": ("Msg", "Message", "Msgs"), "srv": ("Srv", "Service"), "action": ("Action",)}


def stamped(model: Model) -> Iterator[Diagnostic]:
    """A message called …Stamped begins with its stamp: `std_msgs/Header header`, or a time."""
    for interface in model.own:
        if not isinstance(interface, ir.Message) or not interface.name.name.endswith("Stamped"):
            continue
        first = interface.fields[0] if interface.fields else None
        if first is None or not _is_stamp(first, model):
            yield codes.STAMPED_WITHOUT_HEADER.at(
                (first and first.type_span) or _top(interface),
                f"`{interface.name.name}` has no time stamp in its first field",
                hint="begin with the field `std_msgs/Header header`, which tf and message filters "
                "need, or with `builtin_interfaces/Time stamp`",
            )


def _is_stamp(field: ir.Field, model: Model) -> bool:
    """Return whether a field is a stamp, or has an erroneous type anyway."""
    if isinstance(field.type, ir.Ref) and field.type.target not in model.interfaces:
        return True
    is_header = field.type == HEADER and field.name == "header"
    return is_header or field.type in (TIME, ir.Unknown())


def _top(interface: ir.Interface) -> Span | None:
    return Span(interface.source, 0, 0) if interface.source else None


def documented_interfaces(model: Model) -> Iterator[Diagnostic]:
    """Every file begins with a comment about its purpose."""
    for interface in model.own:
        if interface.source and not any(part.comment for part in derive.sections(interface)):
            noun = {"msg": "message", "srv": "service"}.get(interface.name.kind, "action")
            message = f"{noun} `{interface.name.name}` has no comment that describes it"
            hint = "begin the file with a comment, followed by an empty line"
            yield codes.UNDOCUMENTED_INTERFACE.at(_top(interface), message, hint=hint)


def documented_fields(model: Model) -> Iterator[Diagnostic]:
    """Every field has a comment or a unit."""
    for field in own_fields(model):
        if not field.comment and not unit_of(field):
            message = f"`{field.name}` has neither a comment nor a unit"
            hint = "write a comment above or beside the field"
            yield codes.UNDOCUMENTED_FIELD.at(field.name_span, message, hint=hint)


def _quantities(model: Model) -> Iterable[ir.Field]:
    """Return the fields that hold floating-point numbers."""
    floats = (ir.Primitive("float32"), ir.Primitive("float64"))
    return (field for field in own_fields(model) if ir.element_of(field.type) in floats)


def missing_units(model: Model) -> Iterator[Diagnostic]:
    """A number whose name is a physical quantity has a unit."""
    for field in _quantities(model):
        unit = expects_unit(field.name)
        if not unit or unit_of(field):
            continue
        if unit not in re.sub(r"[()]", " ", "\n".join(field.comment)).split():
            hint = f"write a unit in brackets in the comment, as in `# [{unit}]`"
            yield codes.MISSING_UNIT.at(field.name_span, f"`{field.name}` has no unit", hint=hint)


def unusual_units(model: Model) -> Iterator[Diagnostic]:
    """Units follow REP 103: metres, radians, seconds."""
    for field in _quantities(model):
        unit = unit_of(field)
        usual = usual_unit(unit) if unit else None
        if unit and usual and not is_known_by(field.name, unit):
            message = f"the unit of `{field.name}` is [{unit}]"
            hint = f"REP 103 recommends [{usual}]"
            yield codes.UNUSUAL_UNIT.at(field.name_span, message, hint=hint)


def constant_prefixes(model: Model) -> Iterator[Diagnostic]:
    """Constants that are values of one thing share the first word of their names."""
    for message in own_sections(model):
        firsts = Counter(constant.name.partition("_")[0] for constant in message.constants)
        names = {word.upper() for field in message.fields for word in field.name.split("_")}
        whole = [constant for constant in message.constants if isinstance(constant.value, int)]
        for constant in whole:
            first = constant.name.partition("_")[0]
            if firsts[first] == 1 and len(whole) > 1 and first not in names:
                text = f"`{constant.name}` does not begin with the name of a field"
                hint = f"rename it after its field, for example to `MODE_{constant.name}`"
                yield codes.CONSTANT_WITHOUT_PREFIX.at(constant.name_span, text, hint=hint)


def enum_marks(model: Model) -> Iterator[Diagnostic]:
    """A field that is marked `idlc: enum` is an integer, and has the constants that it lists."""
    for message in own_sections(model):
        constants: dict[str, list[str]] = {}
        for enum in enums.enums(message):
            names = sorted(constant.name for constant in enum.members.values())
            constants |= dict.fromkeys((field.name for field in enum.fields), names)
        for field in message.fields:
            listed = enums.listed(field)
            if listed is None:
                continue
            if not enums.holds_integers(field.type):
                yield codes.ENUM_WITHOUT_CONSTANTS.at(
                    field.name_span,
                    f"`{field.name}` cannot have an enum, because it is not an integer",
                    hint="remove the comment `idlc: enum`",
                )
                continue
            names = constants.get(field.name, [])
            if empty := [f"`{word}`" for word in listed if not _is_used(word, names)]:
                yield codes.ENUM_WITHOUT_CONSTANTS.at(
                    field.name_span,
                    f"the enum of `{field.name}` has no constants that match {first_few(empty, 5)}",
                    hint="list integer constants of this section, as in `idlc: enum(NAME, "
                    "PREFIX_*)`; each must fit the field and not belong to another enum",
                )


def _is_used(word: str, names: Sequence[str]) -> bool:
    """Return whether one of the sorted names is `word`, or begins with it up to `_*`."""
    beginning = word.removesuffix("*") if word.endswith("_*") else word
    at = bisect_left(names, beginning)
    nearest = "".join(names[at : at + 1])
    return nearest.startswith(beginning) if beginning != word else nearest == word


def suffixes(model: Model) -> Iterator[Diagnostic]:
    """The name of a file does not repeat its extension."""
    for interface in model.own:
        name, kind = interface.name.name, interface.name.kind
        endings = (ending for ending in _SUFFIXES[kind] if name.endswith(ending) and name != ending)
        if suffix := next(endings, None):
            message = f"the name `{name}.{kind}` repeats the kind of the file"
            better = f"{name.removesuffix(suffix)}.{kind}"
            hint = f"call it `{better}`, unless programs already use the interface"
            yield codes.REDUNDANT_SUFFIX.of(ir.path_of(interface), message, hint=hint)
