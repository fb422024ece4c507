"""The `dataclasses.Field` objects of a message class, for who asks."""

from __future__ import annotations

import dataclasses
from inspect import signature
from typing import TYPE_CHECKING, Any

from .names import public_name, slot_name

if TYPE_CHECKING:
    from .message import Message


def dataclass_fields(kind: type[Message]) -> dict[str, dataclasses.Field[Any]]:
    """Return a class's fields by their Python names, in order."""
    owner: Any = next(
        base for base in kind.__mro__ if "_fields_and_field_types" in base.__dict__
    )
    parameters = signature(owner).parameters
    found = {}
    for wire in owner._fields_and_field_types:
        name = public_name(wire)
        default = parameters[name].default
        if default is None:
            made: Any = dataclasses.field(
                default_factory=_fresh(owner, slot_name(wire))
            )
        else:
            made = dataclasses.field(default=default)
        made.name = name
        made.type = owner.__annotations__.get(name)
        made.kw_only = False
        made._field_type = dataclasses._FIELD  # type: ignore[attr-defined]
        found[name] = made
    return found


def _fresh(owner: type[Message], slot: str) -> Any:
    def make() -> Any:
        return getattr(owner(), slot)

    return make
