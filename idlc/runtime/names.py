"""How the names of an interface appear in Python.

Wire names stay as they are in files, dictionaries and type descriptions. In Python a name that
is a keyword, or that a message class needs for itself, gets a trailing underscore; no field
name can end in one, so two names never meet.
"""

from __future__ import annotations

from keyword import iskeyword

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

#: What a message class offers itself, and what it must not lose to a field.
RESERVED = frozenset(
    {
        "deserialize",
        "deserialize_many",
        "from_dict",
        "get_fields_and_field_types",
        "mro",
        "serialize",
        "serialize_many",
        "to_columns",
        "to_dict",
        "validate",
    }
)

#: Class attributes that look like the slot of a field.
RESERVED_SLOTS = frozenset({"_fields_and_field_types"})


def public_name(field: str) -> str:
    """Return the attribute, and the keyword argument, that a field has in Python."""
    return field + "_" if iskeyword(field) or field in RESERVED else field


def slot_name(field: str) -> str:
    """Return the slot that holds a field's value, named as rosidl names it."""
    slot = "_" + field
    return slot + "_" if slot in RESERVED_SLOTS else slot


def name_of(slot: Any) -> str:
    """Return the public name of the field that a slot's member descriptor holds."""
    name: str = slot.__name__
    return public_name(name[1:].removesuffix("_"))
