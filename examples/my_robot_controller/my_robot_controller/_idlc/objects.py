"""What messages need to be compared, copied and shown."""

from __future__ import annotations

from array import array

from .names import slot_name

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

#: Values that a copy may share.
ATOMIC = frozenset({bool, bytes, float, int, str})
#: Elements up to which Python compares two arrays of numbers before numpy has begun.
SMALL = 64
#: Elements of large arrays that are compared at once.
PIECE = 1 << 16
#: What is not shown of the names of modules.
HIDDEN = ""


def owner_of(kind: type) -> Any:
    """Return the generated class that a class is, or that a user's class derives from."""
    owner = getattr(type(kind), "_message", None)
    if owner is None:
        raise TypeError(f"{kind.__name__} is not a generated message class")
    return owner


def same(mine: Any, other: Any) -> bool:
    """Return whether two fields of numbers, bools or bytes are equal, whatever holds them."""
    if type(mine) is array and type(other) is array:
        if (
            len(mine) > SMALL
            and mine.typecode == other.typecode
            and mine.typecode not in "fd"
        ):
            # only `bytes` and `bytearray` compare memory at once
            if len(mine) <= PIECE or len(mine) != len(other):
                return bytearray(mine) == memoryview(other)
            return _in_pieces(memoryview(mine), memoryview(other))
    elif type(mine).__module__ == "numpy" or type(other).__module__ == "numpy":
        if type(mine) is type(other) and len(mine) <= SMALL:
            return memoryview(mine) == memoryview(other)
        import numpy as np

        return np.array_equal(mine, other)
    return bool(mine == other)


def _in_pieces(mine: memoryview, other: memoryview) -> bool:
    """Return whether two long arrays are equal; a copy of a piece stays in a cache."""
    return all(
        bytearray(mine[at : at + PIECE]) == other[at : at + PIECE]
        for at in range(0, len(mine), PIECE)
    )


def copied(message: Any) -> Any:
    """Return a shallow copy."""
    kind = type(message)
    if owner_of(kind) is not kind:
        return _reconstructed(message, lambda value: value)
    made = object.__new__(kind)
    for slot in kind.__slots__:
        setattr(made, slot, getattr(message, slot))
    return made


def deeply_copied(message: Any, memo: dict[int, Any]) -> Any:
    """Return a copy that shares nothing that can change."""
    from copy import deepcopy

    kind = type(message)
    if owner_of(kind) is not kind:
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


def represented(message: Any) -> str:
    """Return a message as rosidl shows it."""
    parts = []
    for field in message._fields_and_field_types:
        value = getattr(message, slot_name(field))
        shown = value.tolist() if type(value) is array else value
        parts.append(f"{field}={shown!r}")
    return f"{_shown_name(type(message))}({', '.join(parts)})"


# pprint knows what can be shown field by field from where dataclasses make `__repr__`
represented.__qualname__ = "__create_fn__.<locals>.__repr__"


def _shown_name(kind: type) -> str:
    """Return a class's name after that of its package, its module left out."""
    package = kind.__module__.rpartition(".")[0].removeprefix(HIDDEN)
    return f"{package}.{kind.__name__}" if package else kind.__name__


def pretty(message: Any, printer: Any, cycle: bool) -> None:
    """Show a message on as many lines as it takes, with IPython's pretty printer."""
    from .on_demand.fields import named_values

    name = _shown_name(type(message))
    if cycle:
        printer.text(f"{name}(...)")
        return
    with printer.group(len(name) + 1, f"{name}(", ")"):
        for index, (field, value) in enumerate(named_values(message)):
            if index:
                printer.text(",")
                printer.breakable()
            printer.text(f"{field}=")
            printer.pretty(value.tolist() if type(value) is array else value)
