"""C structures as rosidl's C generator lays them out: elements, fields and offsets."""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any

from . import c
from .abi import abi
from .descriptions import ARRAY, NESTED, SCALAR, Field, load

#: Type id in descriptions -> (type id in introspection, C type of one element).
_ELEMENTS: dict[int, tuple[int, Any]] = {
    2: (9, ctypes.c_int8),
    3: (8, ctypes.c_uint8),
    4: (11, ctypes.c_int16),
    5: (10, ctypes.c_uint16),
    6: (13, ctypes.c_int32),
    7: (12, ctypes.c_uint32),
    8: (15, ctypes.c_int64),
    9: (14, ctypes.c_uint64),
    10: (1, ctypes.c_float),
    11: (2, ctypes.c_double),
    15: (6, ctypes.c_bool),
    16: (7, ctypes.c_uint8),
    17: (16, c.String),
    18: (17, c.String),
    21: (16, c.String),
    22: (17, c.String),
}
_MESSAGE = 18


@cache
def structure(name: str) -> type[ctypes.Structure]:
    """Return the C structure that rosidl's C generator would make for a message."""
    fields = [(f"f{i}", _c_type(field)) for i, field in enumerate(load().types[name])]
    return type(name.replace("/", "__"), (ctypes.Structure,), {"_fields_": fields})


def introspection_id(field: Field) -> int:
    """Return how introspection calls the type of a field's elements."""
    return _MESSAGE if field.base == NESTED else _ELEMENTS[field.base][0]


def element_type(field: Field) -> Any:
    """Return the C type of one element of a field."""
    return (
        structure(field.nested_type_name)
        if field.base == NESTED
        else _ELEMENTS[field.base][1]
    )


def _c_type(field: Field) -> Any:
    if field.shape == SCALAR:
        return element_type(field)
    if field.shape == ARRAY:
        return element_type(field) * field.capacity
    return _sequence_type(field)


def _sequence_type(field: Field) -> Any:
    if field.base == NESTED:
        return c.Sequence
    size = abi().strings if element_type(field) is c.String else abi().sequence
    return c.Sequence if size == ctypes.sizeof(c.Sequence) else c.FlaggedSequence


def placed_fields(name: str) -> list[tuple[Field, int]]:
    """Return a message's fields and where each begins in the C structure."""
    kind = structure(name)
    offsets = [getattr(kind, field_name).offset for field_name, *_ in kind._fields_]
    return list(zip(load().types[name], offsets, strict=True))
