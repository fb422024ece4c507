"""Classes that users derive from generated ones, with `@dataclass` or without."""

from __future__ import annotations

from typing import Any

from . import codec
from .objects import owner_of, same


def subclass(
    metaclass: Any,
    name: str,
    bases: tuple[type, ...],
    namespace: dict[str, Any],
    options: dict[str, Any],
) -> Any:
    """Return the subclass; its `deserialize` and `==` are of its own kind."""
    if "__slots__" in namespace:
        fields = {field for base in bases for field in _fields(base)}
        namespace["__slots__"] = _without(fields, namespace["__slots__"])
        namespace.pop("__weakref__", None)  # dataclass() of Python 3.10 forgets it
    made: Any = type.__new__(metaclass, name, bases, namespace, **options)
    owner = metaclass._message
    if owner is not None:
        codec.extended(owner)
        if made.__eq__ is owner.__eq__ and _holds_numbers(owner):
            made.__eq__ = equal
    return made


def _fields(kind: type) -> tuple[str, ...]:
    return getattr(kind, "__match_args__", ())


def _without(fields: set[str], slots: Any) -> Any:
    """Return slots without those of fields, which have theirs: a second one would hide them.

    `dataclass(slots=True)` asks for them.
    """
    if isinstance(slots, str):
        return slots
    if isinstance(slots, dict):
        return {name: doc for name, doc in slots.items() if name not in fields}
    return tuple(name for name in slots if name not in fields)


def _holds_numbers(owner: Any) -> bool:
    """Return whether a field may hold a `numpy.ndarray`, compared element by element."""
    return any(isinstance(owner.__dict__[name], property) for name in _fields(owner))


def equal(self: Any, other: Any) -> Any:
    """Compare as the generated class does, and then the fields that a dataclass adds."""
    kind = type(self)
    owner = owner_of(kind)
    is_dataclass = kind.__dataclass_fields__ is not owner.__dataclass_fields__
    if not is_dataclass or not kind.__dataclass_params__.eq:
        return owner.__eq__(self, other)
    if type(other) is not kind:
        return NotImplemented
    return owner.__eq__(self, other) and all(
        same(getattr(self, name), getattr(other, name))
        for name, field in kind.__dataclass_fields__.items()
        if field.compare and name not in _fields(owner)
    )
