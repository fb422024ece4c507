"""What an interface means, apart from where it stands: values to compare."""

from __future__ import annotations

from collections.abc import Hashable

import msgspec

from idlc.model import ir

_PLACES = frozenset({"source", "name_span", "type_span", "default_span", "value_span"})
_CHAR, _UINT8 = ir.Primitive("char"), ir.Primitive("uint8")


def meaning(interface: ir.Interface) -> Hashable:
    """Return a value that is equal for two interfaces exactly when they mean the same.

    Comments and units count, spans and sources do not.
    """
    return _plain(interface)


def content(interface: ir.Interface) -> Hashable:
    """Return a value that is equal for two interfaces if they differ in comments only.

    What IDL does not tell counts as little: units besides those of fields, and `char`.
    """
    return _plain(interface, bare=True)


def _plain(value: object, *, bare: bool = False) -> Hashable:
    if isinstance(value, msgspec.Struct):
        left_out = _PLACES
        if bare:
            left_out |= {"comment"} if isinstance(value, ir.Field) else {"comment", "unit"}
            value = _UINT8 if value == _CHAR else value
        fields = (name for name in value.__struct_fields__ if name not in left_out)
        inside = ((name, _plain(getattr(value, name), bare=bare)) for name in fields)
        return type(value).__name__, *inside
    if isinstance(value, tuple):
        return tuple(_plain(one, bare=bare) for one in value)
    # NaN is not equal to itself, 1 is to 1.0 and True
    return type(value).__name__, repr(value)
