"""The names of an interface in Python, and module attributes that are imported on first use.

Wire names stay as they are in files, dictionaries and type descriptions. In Python a name that
is a keyword gets a trailing underscore; no name of ROS can end in one, so two names never meet.
"""

from __future__ import annotations

import sys
from keyword import iskeyword

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
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


def lazily(
    package: str, modules: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` (PEP 562) for a package's names, by their `modules`.

    Classes are found by their names on the wire, too.
    """

    def get(name: str) -> Any:
        if name not in modules:
            name = public_name(name)
        module = modules.get(name)
        if module is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        # what importlib.import_module does, without its import
        value = getattr(__import__(f"{package}.{module}", fromlist=[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    def names() -> list[str]:
        own = {*vars(sys.modules[package]), *modules}
        return sorted(own - {"TYPE_CHECKING", "annotations"})

    return get, names
