"""Checking values against their fields, in words that say what to do."""

from __future__ import annotations

import math
from array import array
from typing import Any

from .errors import ValidationError
from .typeinfo import FieldInfo, Primitive, fields_of, type_name


def validate(message: Any, *, wire_only: bool = False) -> None:
    """Raise ValidationError for the first value that its field cannot hold.

    `wire_only` leaves out what the wire does not enforce: the bounds of strings.
    """
    _message(message, type_name(type(message)), "", wire_only)


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
    if isinstance(values, (str, dict, set)) or not hasattr(values, "__len__"):
        raise ValidationError(path, "a sequence", values)
    if field.size is not None and len(values) != field.size:
        raise ValidationError(
            path, f"{field.size} elements, it has {len(values)}", values
        )
    if field.bound is not None and len(values) > field.bound:
        allowed = f"at most {field.bound} elements, it has {len(values)}"
        raise ValidationError(path, allowed, values)
    if field.primitive is not None and _holds(values, field.primitive):
        return
    for index, value in enumerate(values):
        _element(value, field, f"{path}[{index}]", wire_only)


def _holds(values: Any, primitive: Primitive) -> bool:
    """Whether an array's own type already says that all elements fit."""
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
        allowed = f"at most {field.text_bound} characters, it has {len(value)}"
        raise ValidationError(path, allowed, value)


def _primitive(value: Any, primitive: Primitive, path: str) -> None:
    if primitive.code == "?":
        if not isinstance(value, (bool, int)) and type(value).__name__ not in {
            "bool_",
            "bool",
        }:
            raise ValidationError(path, "a bool", value)
    elif primitive.code == "c":
        if not isinstance(value, bytes) or len(value) != 1:
            raise ValidationError(path, "bytes of length 1", value)
    elif primitive.code in "fd":
        _float(value, primitive, path)
    else:
        _integer(value, primitive, path)


def _integer(value: Any, primitive: Primitive, path: str) -> None:
    allowed = f"an integer from {primitive.low} to {primitive.high} ({primitive.name})"
    try:
        number = value.__index__()
    except (AttributeError, TypeError):
        raise ValidationError(path, allowed, value) from None
    assert primitive.low is not None
    assert primitive.high is not None
    if not primitive.low <= number <= primitive.high:
        raise ValidationError(path, allowed, value)


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
        allowed = (
            f"a number from {primitive.low} to {primitive.high} ({primitive.name})"
        )
        raise ValidationError(path, allowed, value)
