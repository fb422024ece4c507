"""Constructors: what they leave to `checked`, and messages that are to check their fields.

`checked` is imported when somebody needs it, and nobody does as a rule.
"""

from __future__ import annotations

from os import environ

from .objects import owner_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

#: Whether all messages check their fields. Read once, as in rosidl's modules.
CHECK_FIELDS = environ.get("ROS_PYTHON_CHECK_FIELDS") == "1"


def construct(message: Any, options: Mapping[str, Any], given: dict[str, Any]) -> bool:
    """Do what a constructor leaves to `checked`, and return whether nothing is left to do."""
    from . import checked

    return checked.construct(message, options, given)


def call_checked(cls: Any, *values: Any, **named: Any) -> Any:
    """Make a message that checks its fields, as the environment asks for."""
    if "check_fields" in cls._fields_and_field_types:
        return type.__call__(cls, *values, **named)  # the name is a field's
    if owner_of(cls) is cls:
        return type.__call__(cls, *values, **{"check_fields": True, **named})
    message = type.__call__(cls, *values, **named)
    message._check_fields = True
    return message


def checking(kind: Any) -> Any:
    """Return the subclass of a message class whose instances check their fields."""
    from . import checked

    return checked.checked_class(kind)


def is_checked(kind: type) -> bool:
    """Return whether the instances of a class check their fields."""
    # only what has imported `checked` has such instances
    return any(base.__module__.endswith("._idlc.checked") for base in kind.__mro__)
