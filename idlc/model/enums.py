"""Constants that are the values of fields: the members of the enums in generated classes.

A field gets an enum if its comment says `idlc: enum`, or, where that is asked for, by its name.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Literal, TypeAlias

import msgspec

from idlc.model import ir, python_names

#: Enums for the fields that are marked, for all fields whose names constants begin with, or none.
Choice: TypeAlias = Literal["marked", "all", "none"]

#: What a field lists: names of constants, and prefixes such as `MODE_*`.
_Words: TypeAlias = tuple[str, ...]

#: Python 3.10 takes time by the square of the members to make an enum.
MOST = 1000

# the lengths are bounded, or a long comment without an end would take for ever
_MARK = re.compile(r"\bidlc:\s{0,20}enum\b(?:\s{0,20}\(([^)]{0,2000}))?")


class Enum(msgspec.Struct, frozen=True):
    """The values of some fields, integers or arrays of them; `members` are by name in the enum."""

    name: python_names.ClassName
    fields: tuple[ir.Field, ...]
    members: dict[str, ir.Constant]


def listed(field: ir.Field) -> tuple[str, ...] | None:
    """Return the constants that a field's mark lists, by default a prefix; `None` without a mark.

    `NAME_*` stands for all constants that begin with `NAME_`.
    """
    match = next(filter(None, map(_MARK.search, field.comment)), None)
    if match is None:
        return None
    words = re.findall(r"[^\s,]+", match[1] or "")
    return tuple(dict.fromkeys(words)) or (_prefix(field),)


def _prefix(field: ir.Field) -> str:
    return f"{field.name.upper()}_*"


def holds_integers(type_: ir.FieldType) -> bool:
    """Return whether values, or the elements of values, are `int` in Python."""
    element = ir.element_of(type_)
    is_number = isinstance(element, ir.Primitive) and element.info.low is not None
    return is_number and element != ir.Primitive("byte")


def enums(message: ir.Message, choice: Choice = "marked") -> Iterator[Enum]:
    """Yield the enums of a message in the order of its fields.

    A constant belongs to the one that lists it, else to that with the longest prefix, also if this
    is the name of a field without an enum. Fields that list the same constants share an enum. One
    that nobody marked has two members at least, and none more than MOST.
    """
    if choice == "none" or not message.constants:
        return
    groups = _groups(message)
    members = _members(message, groups)
    taken = {constant.name for constant in message.constants}
    taken |= {python_names.class_(name) for name in (message.name, *message.references)}
    for words, fields in groups.items():
        is_marked = any(listed(field) is not None for field in fields)
        least = 1 if is_marked else 2
        if (is_marked or choice == "all") and least <= len(members[words]) <= MOST:
            name = python_names.enum(_stem(words, fields), taken)
            taken.add(name)
            yield Enum(name, tuple(fields), members[words])


def _groups(message: ir.Message) -> dict[_Words, list[ir.Field]]:
    """Return the integer fields by what they list; other fields leave their group empty."""
    groups: dict[_Words, list[ir.Field]] = {}
    for field in message.fields:
        group = groups.setdefault(listed(field) or (_prefix(field),), [])
        if holds_integers(field.type):
            group.append(field)
    return groups


def _members(
    message: ir.Message, groups: dict[_Words, list[ir.Field]]
) -> dict[_Words, dict[str, ir.Constant]]:
    """Return the constants of each group, by their names in its enum."""
    owners = {word: words for words in reversed(groups) for word in words}
    lengths = sorted({len(word) - 1 for word in owners if word.endswith("_*")}, reverse=True)
    members: dict[_Words, dict[str, ir.Constant]] = {words: {} for words in groups}
    for constant in message.constants:
        name = constant.name
        prefixes = (f"{name[:length]}*" for length in lengths if length < len(name))
        word = next((word for word in (name, *prefixes) if word in owners), None)
        if word is not None and _can_hold(groups[owners[word]][:1], constant):
            group = members[owners[word]]
            group[_member_name(name, word, group)] = constant
    return members


def _member_name(name: str, word: str, group: dict[str, ir.Constant]) -> str:
    """Return the name of a constant without the prefix in `word`, if that is a free name."""
    short = name if word == name else name[len(word) - 1 :]
    if short.isidentifier() and short not in group:
        return short
    return f"{name}_" if name in group else name


def _stem(words: _Words, fields: list[ir.Field]) -> str:
    """Return what an enum is named after: its only prefix, or its first field."""
    if len(words) == 1 and words[0].endswith("_*"):
        return words[0].removesuffix("_*")
    return fields[0].name


def _can_hold(fields: list[ir.Field], constant: ir.Constant) -> bool:
    elements = (ir.element_of(field.type) for field in fields)
    infos = (element.info for element in elements if isinstance(element, ir.Primitive))
    return holds_integers(constant.type) and any(
        (info.low or 0) <= int(constant.value) <= (info.high or 0) for info in infos
    )
