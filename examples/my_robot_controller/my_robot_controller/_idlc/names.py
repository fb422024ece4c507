"""How the names of an interface appear in Python.

Wire names stay as they are in files, dictionaries and type descriptions. In Python a name that
is a keyword gets a trailing underscore; no name of ROS can end in one, so two names never meet.
"""

from __future__ import annotations

from keyword import iskeyword

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

#: Class attributes that look like the slot of a field.
RESERVED_SLOTS = frozenset({"_fields_and_field_types"})


def public_name(name: str) -> str:
    """Return what a field is called as attribute and argument, or a type as class."""
    return name + "_" if iskeyword(name) else name


def slot_name(field: str) -> str:
    """Return the slot that holds a field's value, named as rosidl names it."""
    slot = "_" + field
    return slot + "_" if slot in RESERVED_SLOTS else slot


def name_of(slot: Any) -> str:
    """Return the public name of the field that a slot's member descriptor holds."""
    name: str = slot.__name__
    return public_name(wire_name(name[1:]))


def wire_name(name: str) -> str:
    """Return the name whose `public_name` is `name`."""
    return name.removesuffix("_")
