"""What an interface means, apart from where it stands: values to compare."""

from __future__ import annotations

from collections.abc import Hashable

import msgspec

from idlc.model import ir

_PLACES = frozenset({"source", "name_span", "type_span", "default_span", "value_span"})


def meaning(interface: ir.Interface) -> Hashable:
    """Return a value that is equal for two interfaces exactly when they mean the same.

    Comments and units count, spans and sources do not.
    """
    return _plain(interface)


def _plain(value: object) -> Hashable:
    if isinstance(value, msgspec.Struct):
        fields = (name for name in value.__struct_fields__ if name not in _PLACES)
        return type(value).__name__, *((name, _plain(getattr(value, name))) for name in fields)
    if isinstance(value, tuple):
        return tuple(map(_plain, value))
    # NaN is not equal to itself, 1 is to 1.0 and True
    return type(value).__name__, repr(value)
