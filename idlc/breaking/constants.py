"""What changed between the constants of two versions of one structure."""

from __future__ import annotations

from collections.abc import Hashable, Iterator

from idlc.breaking.change import Change
from idlc.breaking.fields import Sides
from idlc.breaking.pairing import pair
from idlc.diagnostics import codes
from idlc.diagnostics.source import Span
from idlc.model import ir
from idlc.model.spelling import spell, spell_value


def constant_changes(sides: Sides) -> Iterator[Change]:
    """Yield what changed between the constants; their order says nothing."""
    pairing = pair(sides.old.constants, sides.new.constants, _content)
    for constant in pairing.removed:
        yield _gone(sides, constant)
    for old, new in pairing.renamed:
        yield _renamed(sides, old, new)
    for old, new in pairing.kept:
        if _native(old) != _native(new):
            yield _retyped(sides, old, new)
        if repr(old.value) != repr(new.value):
            yield _value(sides, old, new)


def added(sides: Sides) -> Iterator[str]:
    """Yield the constants that the new version has and the old one had not."""
    for constant in pair(sides.old.constants, sides.new.constants, _content).added:
        yield f"constant `{sides.subject(constant.name)}`"


def _content(constant: ir.Constant) -> Hashable:
    return constant.type, repr(constant.value)


def _native(constant: ir.Constant) -> object:
    """Return a value that is equal for types that are one type in C++ and in Python."""
    return ir.Primitive("uint8") if constant.type == ir.Primitive("char") else constant.type


def _gone(sides: Sides, constant: ir.Constant) -> Change:
    return Change(
        codes.CONSTANT_REMOVED,
        sides.subject(constant.name),
        f"constant `{constant.name}` was removed",
        frozenset({"source"}),
        span=Span(sides.new.source, 0, 0) if sides.new.source else None,
        old=constant.name_span,
        path=sides.path,
    )


def _renamed(sides: Sides, old: ir.Constant, new: ir.Constant) -> Change:
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
