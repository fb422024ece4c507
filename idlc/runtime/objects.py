"""Comparing and copying messages, by functions that are made for a class on first use."""

from __future__ import annotations

from array import array
from copy import deepcopy
from operator import attrgetter, eq

from .names import public_name, slot_name

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from .message import Message

#: Values that a copy may share.
ATOMIC = frozenset({bool, bytes, float, int, str})


def equality(kind: type[Message]) -> Callable[[Any, object], Any]:
    """Return `__eq__` for the class that declares the fields."""
    members = vars(kind)
    numeric: list[str] = []
    plain: list[str] = []
    for field in kind._fields_and_field_types:
        converted = isinstance(members[public_name(field)], property)
        (numeric if converted else plain).append(slot_name(field))
    values = _getter(plain)
    numbers = _getter(numeric)
    everything = _getter([*plain, *numeric])

    def equal(self: Any, other: object) -> Any:
        if not isinstance(other, kind):
            return NotImplemented
        try:
            # not the tuples as such: they would find the same nan equal to itself
            if not all(map(eq, values(self), values(other))):
                return False
        except ValueError:  # a list field holds a numpy array
            return all(map(_same, everything(self), everything(other)))
        return all(map(_same, numbers(self), numbers(other)))

    return equal


def _getter(slots: list[str]) -> Callable[[Any], tuple[Any, ...]]:
    """Return a function that returns the values of slots."""
    if not slots:
        return lambda _: ()
    get = attrgetter(*slots)
    return get if len(slots) > 1 else lambda message: (get(message),)


def _same(mine: Any, other: Any) -> bool:
    """Return whether two values are equal, arrays as a whole."""
    if type(mine) is array and type(other) is array:
        if mine.typecode == other.typecode and mine.typecode not in "fd":
            return mine.tobytes() == other.tobytes()
    elif type(mine).__module__ == "numpy" or type(other).__module__ == "numpy":
        import numpy as np

        return np.array_equal(mine, other)
    return bool(mine == other)


def copied(message: Any) -> Any:
    """Return a shallow copy."""
    kind = type(message)
    if "_codec_" not in kind.__dict__:
        return _reconstructed(message, lambda value: value)
    made = object.__new__(kind)
    for slot in kind.__slots__:
        setattr(made, slot, getattr(message, slot))
    return made


def deeply_copied(message: Any, memo: dict[int, Any]) -> Any:
    """Return a copy that shares nothing that can change."""
    kind = type(message)
    if "_codec_" not in kind.__dict__:
        return _reconstructed(message, lambda value: deepcopy(value, memo), memo)
    made = memo[id(message)] = object.__new__(kind)
    for slot in kind.__slots__:
        value = getattr(message, slot)
        if type(value) not in ATOMIC:
            value = deepcopy(value, memo)
        setattr(made, slot, value)
    return made


def _reconstructed(
    message: Any, copy_of: Callable[[Any], Any], memo: dict[int, Any] | None = None
) -> Any:
    """Return a copy of an instance of a user's subclass, which may have more than slots."""
    reduced: Any = object.__reduce_ex__(message, 4)
    state = reduced[2]
    made = object.__new__(type(message))
    if memo is not None:
        memo[id(message)] = made
    for part in state if isinstance(state, tuple) else (state,):
        for name, value in (part or {}).items():
            object.__setattr__(made, name, copy_of(value))
    return made
