"""The changes between the fields and constants of two versions of one structure."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Hashable, Iterable, Iterator
from typing import NamedTuple

from idlc.compare.changes import (
    Change,
    Level,
    Pairing,
    container,
    describe_type,
    native,
    pair,
    tighter,
    without_bounds,
)
from idlc.diagnostics import codes
from idlc.diagnostics.source import Span
from idlc.model import ir
from idlc.model.ir import spell, spell_value
from idlc.model.link import Model
from idlc.wire.compatible import reads_alike, type_reads_alike


class Sides(NamedTuple):
    """A structure in two versions, each with the model of its types."""

    old: ir.Message
    new: ir.Message
    before: Model
    after: Model

    def subject(self, name: str) -> str:
        """Return the name of an element in allow-lists."""
        return f"{self.new.name}.{name}"

    @property
    def path(self) -> str:
        """The file of the new version."""
        return self.new.source.path if self.new.source else str(self.new.name)


def field_changes(sides: Sides) -> Iterator[Change]:
    """Yield the changes of the fields, in the order of the new version.

    The level `wire` is decided for the structure as a whole: two changes can cancel each other.
    """
    changes = list(_changes(sides))
    broken = not reads_alike(sides.old, sides.new, sides.before.messages, sides.after.messages)
    if not broken:
        changes = [change.without("wire") for change in changes]
    elif not any("wire" in change.levels for change in changes):
        changes = [
            change._replace(levels=change.levels | {"wire"}) if "hash" in change.levels else change
            for change in changes
        ]
    if any("hash" in change.levels for change in changes) and _same_hash(sides):
        changes = [change.without("hash") for change in changes]
    yield from (change for change in changes if change.levels)


def _same_hash(sides: Sides) -> bool:
    name = str(sides.new.name)
    return sides.before.describer.hash(name) == sides.after.describer.hash(name)


def _changes(sides: Sides) -> Iterator[Change]:
    pairing = pair(sides.old.fields, sides.new.fields, lambda field: field.type)
    yield from _all_removed(sides, pairing)
    for old, new in pairing.renamed:
        yield _renamed(sides, old, new)
    yield from _all_added(sides, pairing)
    for old, new in pairing.kept:
        if new.name in pairing.moved:
            yield _moved(sides, old, new)
    yield from _optional(sides)
    for old, new in (*pairing.kept, *pairing.renamed):
        yield from _element_changes(sides, old, new)


def _optional(sides: Sides) -> Iterator[Change]:
    """Yield the change if a structure has `@optional` now, at its first such field."""
    first = next((field for field in sides.new.fields if field.optional), None)
    if first is not None and not any(field.optional for field in sides.old.fields):
        yield Change(
            codes.OPTIONAL_ADDED,
            sides.subject(first.name),
            f"`{first.name}` is `@optional` now: ROS 2 Kilted and older reject the file",
            frozenset({"source"}),
            span=first.name_span,
            path=sides.path,
            hint="leave it out; it has no effect",
        )


def _element_changes(sides: Sides, old: ir.Field, new: ir.Field) -> Iterator[Change]:
    if old.type != new.type:
        yield _type(sides, old, new)
    elif isinstance(target := ir.element_of(new.type), ir.Ref):
        yield from _used_type(sides, old, new, str(target.target))
    if _default(old) != _default(new):
        yield _default_changed(sides, old, new)
    if old.unit and new.unit and old.unit != new.unit:
        yield _unit(sides, old, new)


def _places(fields: Iterable[ir.Field]) -> dict[str, int]:
    return {field.name: place for place, field in enumerate(fields)}


def _all_removed(sides: Sides, pairing: Pairing[ir.Field]) -> Iterator[Change]:
    places = _places(sides.old.fields)
    last = max((places[old.name] for old, _ in (*pairing.kept, *pairing.renamed)), default=-1)
    kept = [places[old.name] for old, _ in pairing.kept]
    end = sides.new.fields[-1] if sides.new.fields else None
    for field in pairing.removed:
        place = places[field.name]
        followed = bisect_right(kept, place)
        beside = pairing.kept[followed][1] if followed < len(kept) else end
        yield _removed(sides, field, beside, is_last=last < place)


def _removed(sides: Sides, field: ir.Field, beside: ir.Field | None, *, is_last: bool) -> Change:
    """Return the change; `is_last` is whether no field that stayed comes after it."""
    levels: set[Level] = {"hash", "source"} if is_last else {"hash", "source", "wire"}
    return Change(
        codes.FIELD_REMOVED,
        sides.subject(field.name),
        f"field `{field.name}` was removed",
        frozenset(levels),
        span=_start_of(beside, sides),
        old=field.name_span,
        path=sides.path,
        hint="keep it and say in its comment that it is no longer used",
    )


def _start_of(beside: ir.Field | None, sides: Sides) -> Span | None:
    """Return a range in the new file for an element that was removed."""
    if beside is not None and beside.type_span is not None:
        return beside.type_span
    return Span(sides.new.source, 0, 0) if sides.new.source else None


def _renamed(sides: Sides, old: ir.Field, new: ir.Field) -> Change:
    return Change(
        codes.FIELD_RENAMED,
        sides.subject(old.name),
        f"field `{old.name}` is called `{new.name}` now",
        frozenset({"hash", "source"}),
        span=new.name_span,
        old=old.name_span,
        path=sides.path,
    )


def _all_added(sides: Sides, pairing: Pairing[ir.Field]) -> Iterator[Change]:
    places = _places(sides.new.fields)
    last = max((places[new.name] for _, new in (*pairing.kept, *pairing.renamed)), default=-1)
    for field in pairing.added:
        yield _added(sides, field, is_last=last < places[field.name])


def _added(sides: Sides, field: ir.Field, *, is_last: bool) -> Change:
    """Return the change; `is_last` is whether no field that stayed comes after it."""
    levels: set[Level] = {"wire", "hash"}
    if not is_last:
        levels.add("source")  # positional arguments and patterns refer to other fields now
    return Change(
        codes.FIELD_ADDED,
        sides.subject(field.name),
        f"field `{field.name}` was added",
        frozenset(levels),
        span=field.name_span,
        path=sides.path,
        hint="add a new message instead, if old and new programs must understand each other",
    )


def _moved(sides: Sides, old: ir.Field, new: ir.Field) -> Change:
    return Change(
        codes.FIELD_MOVED,
        sides.subject(new.name),
        f"field `{new.name}` was moved",
        frozenset({"wire", "hash", "source"}),
        span=new.name_span,
        old=old.name_span,
        path=sides.path,
        hint="put it back; the order of the fields is the order of the bytes",
    )


def _is_last(field: ir.Field, message: ir.Message) -> bool:
    return field is message.fields[-1]


def _type(sides: Sides, old: ir.Field, new: ir.Field) -> Change:
    package = sides.new.name.package
    levels: set[Level] = set()
    at_end = _is_last(new, sides.new)
    before, after = sides.before.messages, sides.after.messages
    if not type_reads_alike(old.type, new.type, before, after, at_end=at_end):
        levels.add("wire")
    if describe_type(old) != describe_type(new):
        levels.add("hash")
    only_bounds = without_bounds(old.type) == without_bounds(new.type)
    if not only_bounds or container(old.type) != container(new.type):
        levels.add("source")
    if tighter(old.type, new.type):
        levels.add("behaviour")
    if native(old.type) == native(new.type):
        levels -= {"source"}
    return Change(
        codes.FIELD_BOUND_CHANGED if only_bounds else codes.FIELD_TYPE_CHANGED,
        sides.subject(new.name),
        f"field `{new.name}` was `{spell(old.type, package)}` "
        f"and is `{spell(new.type, package)}` now",
        frozenset(levels),
        span=new.type_span,
        old=old.type_span,
        path=sides.path,
    )


def _used_type(sides: Sides, old: ir.Field, new: ir.Field, target: str) -> Iterator[Change]:
    levels: set[Level] = set()
    if sides.before.describer.hash(target) != sides.after.describer.hash(target):
        levels.add("hash")
    before, after = sides.before.messages, sides.after.messages
    at_end = _is_last(new, sides.new)
    if not type_reads_alike(old.type, new.type, before, after, at_end=at_end):
        levels.add("wire")
    if levels:
        yield Change(
            codes.USED_TYPE_CHANGED,
            sides.subject(new.name),
            f"`{target}`, the type of field `{new.name}`, changed",
            frozenset(levels),
            span=new.type_span,
            path=sides.path,
            cause=target,
        )


def _default(field: ir.Field) -> str | None:
    return None if field.default is None else repr(field.default.value)


def _default_changed(sides: Sides, old: ir.Field, new: ir.Field) -> Change:
    levels: set[Level] = {"behaviour"}
    if old.default is None:
        message = f"field `{new.name}` has a default value now"
    elif new.default is None:
        message = f"field `{new.name}` lost its default value, {spell_value(old.default.value)}"
        levels.add("source")
    else:
        message = (
            f"the default of `{new.name}` was {spell_value(old.default.value)} "
            f"and is {spell_value(new.default.value)} now"
        )
    return Change(
        codes.FIELD_DEFAULT_CHANGED,
        sides.subject(new.name),
        message,
        frozenset(levels),
        span=new.default_span or new.name_span,
        old=old.default_span,
        path=sides.path,
    )


def _unit(sides: Sides, old: ir.Field, new: ir.Field) -> Change:
    return Change(
        codes.UNIT_CHANGED,
        sides.subject(new.name),
        f"the unit of `{new.name}` was [{old.unit}] and is [{new.unit}] now",
        frozenset({"behaviour"}),
        span=new.name_span,
        old=old.name_span,
        path=sides.path,
        hint="give the field another name, so that nobody uses the old unit by mistake",
    )


def constant_changes(sides: Sides) -> Iterator[Change]:
    """Yield the changes of the constants; their order has no meaning."""
    pairing = pair(sides.old.constants, sides.new.constants, _content)
    for constant in pairing.removed:
        yield _removed_constant(sides, constant)
    for old, new in pairing.renamed:
        yield _renamed_constant(sides, old, new)
    for old, new in pairing.kept:
        if _native(old) != _native(new):
            yield _retyped(sides, old, new)
        if repr(old.value) != repr(new.value):
            yield _value(sides, old, new)


def added(sides: Sides) -> Iterator[str]:
    """Yield the constants that only the new version has."""
    for constant in pair(sides.old.constants, sides.new.constants, _content).added:
        yield f"constant `{sides.subject(constant.name)}`"


def _content(constant: ir.Constant) -> Hashable:
    return constant.type, repr(constant.value)


def _native(constant: ir.Constant) -> object:
    """Return a value that is equal for types that are one type in C++ and in Python."""
    return ir.Primitive("uint8") if constant.type == ir.Primitive("char") else constant.type


def _removed_constant(sides: Sides, constant: ir.Constant) -> Change:
    return Change(
        codes.CONSTANT_REMOVED,
        sides.subject(constant.name),
        f"constant `{constant.name}` was removed",
        frozenset({"source"}),
        span=Span(sides.new.source, 0, 0) if sides.new.source else None,
        old=constant.name_span,
        path=sides.path,
    )


def _renamed_constant(sides: Sides, old: ir.Constant, new: ir.Constant) -> Change:
    return Change(
        codes.CONSTANT_RENAMED,
        sides.subject(old.name),
        f"constant `{old.name}` is called `{new.name}` now",
        frozenset({"source"}),
        span=new.name_span,
        old=old.name_span,
        path=sides.path,
        hint=f"keep `{old.name}` beside it, with the same value",
    )


def _retyped(sides: Sides, old: ir.Constant, new: ir.Constant) -> Change:
    return Change(
        codes.CONSTANT_TYPE_CHANGED,
        sides.subject(new.name),
        f"constant `{new.name}` was `{spell(old.type)}` and is `{spell(new.type)}` now",
        frozenset({"source"}),
        span=new.name_span,
        old=old.name_span,
        path=sides.path,
    )


def _value(sides: Sides, old: ir.Constant, new: ir.Constant) -> Change:
    return Change(
        codes.CONSTANT_VALUE_CHANGED,
        sides.subject(new.name),
        f"constant `{new.name}` was {spell_value(old.value)} and is {spell_value(new.value)} now",
        frozenset({"behaviour"}),
        span=new.value_span,
        old=old.value_span,
        path=sides.path,
        hint="both values are in use as long as not everything is rebuilt",
    )
