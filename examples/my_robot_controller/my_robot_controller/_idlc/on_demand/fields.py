"""Messages as the module dataclasses sees them, for who asks."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, get_type_hints

from ..names import slot_name
from ..objects import owner_of

if TYPE_CHECKING:
    from collections.abc import Iterator

#: The `__dataclass_params__` of all messages.
PARAMETERS: Any = dataclasses.make_dataclass(  # type: ignore[attr-defined]
    "Message", [], slots=True
).__dataclass_params__


def dataclass_fields(kind: Any) -> dict[str, dataclasses.Field[Any]]:
    """Return a class's fields by their Python names, in order.

    They are kept on the generated class, which then needs nobody to ask for them.
    """
    if "__dataclass_fields__" in kind.__dict__:  # the base of all messages
        return {}
    owner = owner_of(kind)
    plain = dataclasses.make_dataclass(
        owner.__name__, _fields(owner), init=False, repr=False, eq=False
    )
    found: dict[str, Any] = plain.__dataclass_fields__  # type: ignore[attr-defined]
    owner.__dataclass_fields__ = found
    if "_arrays." not in "".join(owner.__annotations__.values()):
        # pytest explains field by field what dataclasses made, which it knows by this name
        code = owner.__eq__.__code__
        owner.__eq__.__code__ = code.replace(co_filename="<string>")
    return found


def _fields(owner: Any) -> Iterator[tuple[str, Any, dataclasses.Field[Any]]]:
    defaults = owner.__init__.__defaults__ or ()
    names = zip(
        owner.__match_args__, owner._fields_and_field_types, defaults, strict=True
    )
    try:
        types = get_type_hints(owner)
    except ImportError:  # of another package, whose classes only these fields need
        types = owner.__annotations__
    for name, wire, default in names:
        made: Any = (
            dataclasses.field(default_factory=_fresh(owner, slot_name(wire)))
            if default is None
            else dataclasses.field(default=default)
        )
        yield name, types[name], made


def _fresh(owner: Any, slot: str) -> Any:
    def make() -> Any:
        return getattr(owner(), slot)

    return make


def named_values(message: Any) -> Iterator[tuple[str, Any]]:
    """Yield each field's Python name and value, those that a user's subclass adds included."""
    for field in dataclasses.fields(message):
        yield field.name, getattr(message, field.name)
