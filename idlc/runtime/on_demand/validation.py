"""Checking values against their fields, in words that say what to do."""

from __future__ import annotations

import math
from array import array
from typing import Any

from ..errors import FieldRangeError, FieldTypeError, ValidationError
from .typeinfo import PRIMITIVES, FieldInfo, Primitive, fields_of, type_name


def validate(message: Any, *, wire_only: bool = False) -> None:
    """Raise ValidationError for the first value that its field cannot hold.

    `wire_only` leaves out what the wire does not enforce: the bounds of strings.
    """
    _message(message, type_name(type(message)), "", wire_only)


def validate_field(value: Any, field: FieldInfo) -> None:
    """Raise ValidationError if a field, which is named by its path, cannot hold a value."""
    check = _list if field.is_list else _element
    check(value, field, field.public, wire_only=True)


def validate_element(value: Any, field: FieldInfo) -> None:
    """Raise ValidationError if a field, or a list in it, cannot hold a value."""
    _element(value, field, field.public, wire_only=False)


def validate_count(values: Any, field: FieldInfo) -> None:
    """Raise ValidationError if a field cannot hold so many values."""
    _count(values, field, field.public)


def _message(message: Any, name: str, path: str, wire_only: bool) -> None:
    for field in fields_of(name):
        place = f"{path}.{field.public}" if path else field.public
        if not hasattr(message, field.slot):
            raise ValidationError(path or "message", f"a {name}", message)
        value = getattr(message, field.slot)
        if field.is_list:
            _list(value, field, place, wire_only)
        else:
            _element(value, field, place, wire_only)


def _list(values: Any, field: FieldInfo, path: str, wire_only: bool) -> None:
    if isinstance(values, (str, dict)) or not hasattr(values, "__len__"):
        raise ValidationError(path, "a sequence", values)
    _count(values, field, path)
    if field.primitive is not None and _holds(values, field.primitive):
        return
    for index, value in enumerate(values):
        _element(value, field, f"{path}[{index}]", wire_only)


def _count(values: Any, field: FieldInfo, path: str) -> None:
    if field.size is not None and len(values) != field.size:
        problem = f"has {counted(len(values), 'element')}, needs {field.size}"
        raise ValidationError(path, f"{field.size} elements", values, problem)
    if field.bound is not None and len(values) > field.bound:
        _too_many(path, "element", len(values), field.bound, values)


def _holds(values: Any, primitive: Primitive) -> bool:
    """Return whether an array's own type already says that all elements fit."""
    if primitive.code in "?c":
        return isinstance(values, (bytes, bytearray))
    if isinstance(values, array):
        return values.typecode == primitive.code
    dtype = getattr(values, "dtype", None)
    return dtype is not None and dtype.name == primitive.name and values.ndim == 1


def _element(value: Any, field: FieldInfo, path: str, wire_only: bool) -> None:
    if field.nested:
        _message(value, field.nested, path, wire_only)
    elif field.text:
        _text(value, field, path, wire_only)
    else:
        assert field.primitive is not None
        _primitive(value, field.primitive, path)


def _text(value: Any, field: FieldInfo, path: str, wire_only: bool) -> None:
    if not isinstance(value, str):
        raise ValidationError(path, "a str", value)
    try:
        value.encode()
    except UnicodeEncodeError:
        raise ValidationError(path, "a str without lone surrogates", value) from None
    if not wire_only and field.text_bound is not None and len(value) > field.text_bound:
        _too_many(path, "character", len(value), field.text_bound, value)


def _too_many(path: str, what: str, count: int, bound: int, value: object) -> None:
    problem = f"has {counted(count, what)}, at most {bound} are allowed"
    raise ValidationError(path, f"at most {counted(bound, what)}", value, problem)


def counted(count: int, what: str) -> str:
    """Return a number of things in words."""
    return f"{count} {what}{'s' * (count != 1)}"


def _primitive(value: Any, primitive: Primitive, path: str) -> None:
    if primitive.code == "?":
        number = isinstance(value, (int, float)) and value in (0, 1)
        if not number and type(value).__name__ not in {"bool_", "bool"}:
            raise ValidationError(path, primitive.allowed, value)
    elif primitive.code == "c":
        if not isinstance(value, bytes) or len(value) != 1:
            raise ValidationError(path, primitive.allowed, value)
    elif primitive.code in "fd":
        _float(value, primitive, path)
    else:
        _integer(value, primitive, path)


def _integer(value: Any, primitive: Primitive, path: str) -> None:
    try:
        number = value.__index__()
    except (AttributeError, TypeError):
        raise ValidationError(path, primitive.allowed, value) from None
    assert primitive.low is not None
    assert primitive.high is not None
    if not primitive.low <= number <= primitive.high:
        raise ValidationError(path, primitive.allowed, value)


def _float(value: Any, primitive: Primitive, path: str) -> None:
    try:
        number = float(value) if not isinstance(value, (str, bytes)) else None
    except (TypeError, ValueError, OverflowError):
        number = None
    if number is None:
        raise ValidationError(path, f"a number ({primitive.name})", value)
    if primitive.high is None or not math.isfinite(number):
        return
    if abs(number) > primitive.high:
        raise ValidationError(path, primitive.allowed, value)


def refused(
    name: str, kind: str, size: int | None, values: Any, error: Exception
) -> ValidationError:
    """Return the error for values that a field of numbers does not take.

    `kind` is the name of their type, or its code in `struct`. `error` is what Python or
    numpy said, and one of its kind is returned: rosidl's classes raise that.
    """
    primitive = next(one for one in PRIMITIVES.values() if kind in (one.code, one.name))
    field = FieldInfo(name, primitive, False, False, None, "", size, size is None, None)
    found = ValidationError(
        name, f"numbers ({primitive.name})", values, f"{error} ({primitive.name})"
    )
    if isinstance(values, (bytes, bytearray)) and size is None:
        problem = (
            f"has {counted(len(values), 'byte')}, needs a multiple of {primitive.size}"
        )
        found = ValidationError(name, "whole numbers of bytes", values, problem)
    elif (
        isinstance(values, (list, tuple))
        or getattr(values, "ndim", 0) == 1
        or not hasattr(values, "__len__")
    ):
        try:
            _list(values, field, name, wire_only=True)
        except ValidationError as exact:
            found = exact
    raised = ValidationError
    if isinstance(error, OverflowError):
        raised = FieldRangeError
    elif isinstance(error, TypeError) or isinstance(values, (str, dict)):
        raised = FieldTypeError
    return found.at(found.path, raised)  # type: ignore[no-any-return]
