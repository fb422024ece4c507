"""The changes between the fields and constants of two versions of one structure."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Hashable, Iterable, Iterator
from typing import NamedTuple

from idlc.diagnostics import codes
from idlc.diagnostics.source import Span
from idlc.model import ir
from idlc.model.comments import deprecation
from idlc.model.describe import type_dict
from idlc.model.ir import spell, spell_value
from idlc.model.link import Model
from idlc.versions.changes import (
    LEVELS,
    Change,
    Level,
    Pairing,
    native,
    pair,
    tighter,
    without_bound,
)
from idlc.wire.compatible import reads_alike, type_reads_alike


class Sides(NamedTuple):
    """A structure in two versions, each with the model of its types."""

    old: ir.Message
    new: ir.Message
    before: Model
    after: Model

    def change(
        self,
        code: codes.DiagnosticCode,
        element: ir.Field | ir.Constant,
        message: str,
        levels: Iterable[Level],
        span: Span | None,
        old: Span | None = None,
        **facts: str,
    ) -> Change:
        """Return the change of an element, which allow-lists call by the name it has there."""
        subject, path = f"{self.new.name}.{element.name}", ir.path_of(self.new)
        return Change(code, subject, message, frozenset(levels), span, old, path, **facts)

    @property
    def hashes(self) -> tuple[str, str]:
        """The type hashes of the structure."""
        name = str(self.new.name)
        return self.before.describer.hash(name), self.after.describer.hash(name)

    @property
    def is_incomplete(self) -> bool:
        """True if a version may lack constants and default values, so that these tell nothing."""
        sources = self.old.source, self.new.source
        return any(source is not None and source.is_incomplete for source in sources)

    @property
    def top(self) -> Span | None:
        """The beginning of the new version, for what it no longer has."""
        return Span(self.new.source, 0, 0) if self.new.source else None


def field_changes(sides: Sides) -> Iterator[Change]:
    """Yield the changes of the fields, in the order of the new version.

    The level `wire` is decided for the structure as a whole: two changes can cancel each other.
    """
    broken = not reads_alike(sides.old, sides.new, sides.before.messages, sides.after.messages)
    changes = with_wire(list(_changes(sides)), broken)
    if sides.is_incomplete:
        changes = [change for change in changes if change.code is not codes.FIELD_DEFAULT_CHANGED]
    if any("hash" in change.levels for change in changes) and len({*sides.hashes}) == 1:
        changes = [change.without("hash") for change in changes]
    yield from (change for change in changes if change.levels)


def with_wire(changes: list[Change], misread: bool) -> list[Change]:
    """Return changes with the level `wire` if and only if somebody misreads the bytes."""
    if not misread:
        return [change.without("wire") for change in changes]
    if any("wire" in change.levels for change in changes):
        return changes
    return [
        change._replace(levels=change.levels | {"wire"}) if "hash" in change.levels else change
        for change in changes
    ]


def _changes(sides: Sides) -> Iterator[Change]:
    pairing = pair(sides.old.fields, sides.new.fields, lambda field: field.type)
    yield from _removed(sides, pairing)
    for old, new in pairing.renamed:
        message = f"field `{old.name}` was renamed to `{new.name}`"
        spans = new.name_span, old.name_span
        yield sides.change(codes.FIELD_RENAMED, old, message, ("hash", "source"), *spans)
    yield from _added(sides, pairing)
    for old, new in pairing.kept:
        if new.name in pairing.moved:
            message = f"field `{new.name}` was moved"
            hint = "move it back; the bytes of a message follow the order of its fields"
            spans = new.name_span, old.name_span
            yield sides.change(codes.FIELD_MOVED, new, message, LEVELS[:3], *spans, hint=hint)
    # the first such field stands for the structure
    first = next((field for field in sides.new.fields if field.optional), None)
    if first is not None and not any(field.optional for field in sides.old.fields):
        message = f"`{first.name}` is `@optional` now: ROS 2 Kilted and older reject the file"
        hint, span = "remove it; it has no effect", first.name_span
        yield sides.change(codes.OPTIONAL_ADDED, first, message, ("source",), span, hint=hint)
    for old, new in (*pairing.kept, *pairing.renamed):
        yield from _type_changes(sides, old, new)
        if _default(old) != _default(new):
            yield _default_changed(sides, old, new)
        if old.unit and new.unit and old.unit != new.unit:
            message = f"the unit of `{new.name}` changed from [{old.unit}] to [{new.unit}]"
            hint = "rename the field, so that nobody uses the old unit by mistake"
            spans = new.name_span, old.name_span
            yield sides.change(codes.UNIT_CHANGED, new, message, ("behaviour",), *spans, hint=hint)


def _places(fields: Iterable[ir.Field]) -> dict[str, int]:
    return {field.name: place for place, field in enumerate(fields)}


def _removed(sides: Sides, pairing: Pairing[ir.Field]) -> Iterator[Change]:
    places = _places(sides.old.fields)
    last = max((places[old.name] for old, _ in (*pairing.kept, *pairing.renamed)), default=-1)
    kept = [places[old.name] for old, _ in pairing.kept]
    hint = "keep it for one release with a comment such as `# deprecated: use NAME`"
    for field in pairing.removed:
        place = places[field.name]
        following = bisect_right(kept, place)
        beside = [new for _, new in pairing.kept[following : following + 1]]
        spans = [new.type_span for new in (*beside, *sides.new.fields[-1:])]
        # where no field that stayed comes after it, the others are read right
        levels: set[Level] = {"hash", "source"} if last < place else {*LEVELS[:3]}
        message, at = f"field `{field.name}` was removed", next(iter(spans), None) or sides.top
        own = field.name_span
        milder = _milder(levels, field)
        advice = {"hint": hint} if milder == levels else {}
        yield sides.change(codes.FIELD_REMOVED, field, message, milder, at, own, **advice)


def _milder(levels: Iterable[Level], removed: ir.Field | ir.Constant) -> set[Level]:
    """Return the levels of a removal: code that used what was deprecated has been warned."""
    if deprecation(removed.comment) is None:
        return {*levels}
    return {"behaviour" if level == "source" else level for level in levels}


def _added(sides: Sides, pairing: Pairing[ir.Field]) -> Iterator[Change]:
    places = _places(sides.new.fields)
    last = max((places[new.name] for _, new in (*pairing.kept, *pairing.renamed)), default=-1)
    hint = "if old and new programs must communicate, define a new message instead"
    for field in pairing.added:
        # positional arguments and patterns refer to other fields if it is not the last
        levels: set[Level] = {"wire", "hash"} if last < places[field.name] else {*LEVELS[:3]}
        message, span = f"field `{field.name}` was added", field.name_span
        yield sides.change(codes.FIELD_ADDED, field, message, levels, span, hint=hint)


def _type_changes(sides: Sides, old: ir.Field, new: ir.Field) -> Iterator[Change]:
    before, after = ir.element_of(old.type), ir.element_of(new.type)
    if old.type == new.type and not isinstance(after, ir.Ref):
        return
    levels: set[Level] = set()
    at_end = new is sides.new.fields[-1]
    messages = (sides.before.messages, sides.after.messages)
    if not type_reads_alike(old.type, new.type, *messages, at_end=at_end):
        levels.add("wire")
    if old.type == new.type and isinstance(after, ir.Ref):
        target = str(after.target)
        if sides.before.describer.hash(target) != sides.after.describer.hash(target):
            levels.add("hash")
        if levels:
            message, span = f"`{target}`, the type of field `{new.name}`, changed", new.type_span
            yield sides.change(codes.USED_TYPE_CHANGED, new, message, levels, span, cause=target)
        return
    if type_dict(old.type) != type_dict(new.type):
        levels.add("hash")
    if native(old.type) != native(new.type):
        levels.add("source")
    if tighter(before, after):
        levels.add("behaviour")
    only_bounds = type(old.type) is type(new.type) and without_bound(before) == without_bound(after)
    code = codes.FIELD_BOUND_CHANGED if only_bounds else codes.FIELD_TYPE_CHANGED
    was, now = (spell(field.type, sides.new.name.package) for field in (old, new))
    message = f"field `{new.name}` changed from `{was}` to `{now}`"
    yield sides.change(code, new, message, levels, new.type_span, old.type_span)


def _default(field: ir.Field) -> str | None:
    return None if field.default is None else repr(field.default.value)


def _default_changed(sides: Sides, old: ir.Field, new: ir.Field) -> Change:
    levels: tuple[Level, ...] = ("behaviour",)
    if old.default is None:
        message = f"field `{new.name}` now has a default value"
    elif new.default is None:
        message = (
            f"field `{new.name}` no longer has its default value, {spell_value(old.default.value)}"
        )
        levels = ("behaviour", "source")
    else:
        message = (
            f"the default value of `{new.name}` changed from {spell_value(old.default.value)} "
            f"to {spell_value(new.default.value)}"
        )
    span = new.default_span or new.name_span
    return sides.change(codes.FIELD_DEFAULT_CHANGED, new, message, levels, span, old.default_span)


def constant_changes(sides: Sides) -> Iterator[Change]:
    """Yield the changes of the constants; their order has no meaning."""
    if sides.is_incomplete:
        return
    pairing = pair(sides.old.constants, sides.new.constants, _content)
    source: tuple[Level] = ("source",)
    for constant in pairing.removed:
        message = f"constant `{constant.name}` was removed"
        spans = sides.top, constant.name_span
        levels = _milder(source, constant)
        yield sides.change(codes.CONSTANT_REMOVED, constant, message, levels, *spans)
    for old, new in pairing.renamed:
        message = f"constant `{old.name}` was renamed to `{new.name}`"
        hint = f"keep `{old.name}` as well, with the same value"
        spans = new.name_span, old.name_span
        yield sides.change(codes.CONSTANT_RENAMED, old, message, source, *spans, hint=hint)
    for old, new in pairing.kept:
        if native(old.type) != native(new.type):
            was, now = spell(old.type), spell(new.type)
            message = f"constant `{new.name}` changed from `{was}` to `{now}`"
            spans = new.name_span, old.name_span
            yield sides.change(codes.CONSTANT_TYPE_CHANGED, new, message, source, *spans)
        if repr(old.value) != repr(new.value):
            was, now = spell_value(old.value), spell_value(new.value)
            message = f"constant `{new.name}` changed from {was} to {now}"
            hint = "until you rebuild all programs, some use the old value, and others the new one"
            spans, code = (new.value_span, old.value_span), codes.CONSTANT_VALUE_CHANGED
            yield sides.change(code, new, message, ("behaviour",), *spans, hint=hint)


def added(sides: Sides) -> Iterator[str]:
    """Yield the constants that only the new version has."""
    if sides.is_incomplete:
        return
    for constant in pair(sides.old.constants, sides.new.constants, _content).added:
        yield f"constant `{sides.new.name}.{constant.name}`"


def _content(constant: ir.Constant) -> Hashable:
    return constant.type, repr(constant.value)
