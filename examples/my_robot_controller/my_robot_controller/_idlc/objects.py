"""Comparing, copying and showing messages."""

from __future__ import annotations

import sys
from array import array

from .names import slot_name

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Any

#: Values that a copy may share.
ATOMIC = frozenset({bool, bytes, float, int, str})
#: Elements up to which Python compares two arrays of numbers before numpy has begun.
SMALL = 64
#: Elements of large arrays that are compared at once.
PIECE = 1 << 16
#: Packages that are shown under other names than they are imported by.
SHOWN: dict[str, str] = {}
_memcmp_function: Any = None
#: The class of numpy's arrays, once one was met: to ask a class for its module takes longer.
_of_numpy: set[type] = set()


def owner_of(kind: type) -> Any:
    """Return the generated class that a class is, or that a user's class derives from."""
    owner = getattr(type(kind), "_message", None)
    if owner is None:
        raise TypeError(f"{kind.__name__} is not a generated message class")
    return owner


def is_copy(kind: type, other: type) -> bool:
    """Return whether two generated classes are of one type, as those of two libraries may be."""
    owner, others = (getattr(type(each), "_message", None) for each in (kind, other))
    if owner is None or others is None or owner.__name__ != others.__name__:
        return False
    from .typeinfo import structure_of

    return structure_of(owner).hash == structure_of(others).hash


def equal(message: Any, other: Any) -> bool:
    """Compare a message with what is not of its class: a copy of it has the same fields."""
    if not is_copy(type(message), type(other)):
        return NotImplemented  # type: ignore[no-any-return]
    slots: list[str] = owner_of(type(message)).__slots__
    return all(same(getattr(message, slot), getattr(other, slot)) for slot in slots)


def same(mine: Any, other: Any) -> bool:
    """Return whether two fields of numbers, bools or bytes are equal, whatever holds them."""
    kind = type(mine)
    if kind is array and type(other) is array:
        if mine.typecode == other.typecode:
            if mine.typecode in "fd":  # no nan is equal to another
                return memoryview(mine) == memoryview(other)
            if len(mine) > SMALL:
                return len(mine) == len(other) and _same_memory(mine, other)
    elif kind in _of_numpy and type(other) is kind and len(mine) <= SMALL:
        return bool(mine.data == other)
    elif kind.__module__ == "numpy" or type(other).__module__ == "numpy":
        import numpy as np

        _of_numpy.add(np.ndarray)
        return np.array_equal(mine, other)
    return bool(mine == other)


def _same_memory(mine: array[Any], other: array[Any]) -> bool:
    """Return whether two arrays of one size and kind hold the same bytes."""
    if len(mine) <= PIECE:  # only `bytes` and `bytearray` compare memory at once
        return bytearray(mine) == memoryview(other)
    with (
        memoryview(mine) as left,
        memoryview(other) as right,
    ):  # no thread moves them now
        compare = _memcmp()
        if compare is None:  # a copy of a piece stays in a cache
            pieces = range(0, len(left), PIECE)
            return all(
                bytearray(left[at : at + PIECE]) == right[at : at + PIECE]
                for at in pieces
            )
        (left_address, _), (right_address, _) = mine.buffer_info(), other.buffer_info()
        return bool(compare(left_address, right_address, left.nbytes) == 0)


def _memcmp() -> Any:
    """Return the function of C, if ctypes has been loaded, as it is with numpy and rclpy."""
    global _memcmp_function
    if _memcmp_function is None and "ctypes" in sys.modules:
        import ctypes

        try:
            function = ctypes.pythonapi["memcmp"]
        except AttributeError:  # Windows
            return None
        function.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t)
        _memcmp_function = function  # not before: another thread may be waiting for it
    return _memcmp_function


def copied(message: Any) -> Any:
    """Return a shallow copy."""
    kind = type(message)
    if owner_of(kind) is not kind:
        return _reconstructed(message, lambda value: value)
    duplicate = object.__new__(kind)
    for slot in kind.__slots__:
        setattr(duplicate, slot, getattr(message, slot))
    return duplicate


def deeply_copied(message: Any, memo: dict[int, Any]) -> Any:
    """Return a copy that shares nothing that can change."""
    from copy import deepcopy

    kind = type(message)
    if owner_of(kind) is not kind:
        return _reconstructed(message, lambda value: deepcopy(value, memo), memo)
    duplicate = memo[id(message)] = object.__new__(kind)
    for slot in kind.__slots__:
        value = getattr(message, slot)
        if type(value) not in ATOMIC:
            value = deepcopy(value, memo)
        setattr(duplicate, slot, value)
    return duplicate


def _reconstructed(
    message: Any, copy_of: Callable[[Any], Any], memo: dict[int, Any] | None = None
) -> Any:
    """Return a copy of an instance of a user's subclass, which may have more than slots."""
    reduced: Any = object.__reduce_ex__(message, 4)
    state = reduced[2]
    duplicate = object.__new__(type(message))
    if memo is not None:
        memo[id(message)] = duplicate
    for part in state if isinstance(state, tuple) else (state,):
        for name, value in (part or {}).items():
            object.__setattr__(duplicate, name, copy_of(value))
    return duplicate


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
    package = kind.__module__.rpartition(".")[0]
    home, _, last = package.rpartition(".")
    if home in SHOWN:
        package = f"{SHOWN[home]}.{last}"
    return f"{package}.{kind.__name__}" if package else kind.__name__


def named_values(message: Any) -> Iterator[tuple[str, Any]]:
    """Yield each field's Python name and value, those that a user's subclass adds included."""
    import dataclasses

    for field in dataclasses.fields(message):
        yield field.name, getattr(message, field.name)


def pretty(message: Any, printer: Any, cycle: bool) -> None:
    """Show a message on as many lines as it takes, with IPython's pretty printer."""
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
