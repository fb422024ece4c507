"""How pydantic checks messages, and how it writes them: a `CoreSchema` is made of dictionaries."""

from __future__ import annotations

from typing import Any

from ..message import Message


def message_schema(fields: Any) -> Any:
    """Return the schema of a message, given that of its fields as a dataclass."""
    return {
        "type": "function-wrap",
        "function": {"type": "no-info", "function": _checked},
        "schema": fields,
    }


def _checked(value: Any, make: Any) -> Any:
    """Return the message that pydantic makes of a value; raise ValueError for a wrong one."""
    try:
        message = make(value)
    except (OverflowError, TypeError) as error:
        raise ValueError(str(error)) from None
    Message.validate(message)
    return message


def numbers_schema(elements: Any) -> Any:
    """Return the schema of an array of numbers, given that of a list of them."""
    return {
        "type": "function-before",
        "function": {"type": "no-info", "function": _listed},
        "schema": elements,
        "serialization": {"type": "function-plain", "function": _listed},
    }


def _listed(values: Any) -> Any:
    if isinstance(values, (bytes, bytearray)):
        return list(values)
    return values.tolist() if hasattr(values, "tolist") else values
