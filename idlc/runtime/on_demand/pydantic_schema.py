"""How pydantic checks messages, and how it writes them: a `CoreSchema` is made of dictionaries."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..message import Message
from .typeinfo import FieldInfo, fields_of, type_name
from .validation import validate_count, validate_element


def message_schema(cls: Any, found: Any, handler: Any) -> Any:
    """Return the schema of a message, given the one that it has as a dataclass.

    That may be a reference; what it leads to is changed, because other fields have it, too.
    """
    schema = handler.resolve_ref_schema(found)
    if schema["type"] == "dataclass":
        own = {field.public: field for field in fields_of(type_name(cls))}
        for one in schema["schema"].get("fields", ()):
            if one["name"] in own:  # subclasses have more
                _check(one, own[one["name"]])
        inner = {key: schema[key] for key in schema if key != "ref"}
        shared = {"ref": schema["ref"]} if "ref" in schema else {}
        schema.clear()
        function = {"type": "no-info", "function": _checked}
        schema.update(shared, type="function-wrap", function=function, schema=inner)
    return found


def _checked(value: Any, make: Any) -> Any:
    """Return the message that pydantic makes of a value; raise ValueError for a wrong one."""
    try:
        message = make(value)
    except (OverflowError, TypeError) as error:
        raise ValueError(str(error)) from None
    if message is value:
        Message.validate(message)
    return message


def _check(holder: Any, field: FieldInfo) -> None:
    """Add checks to the schema of a field, each where pydantic knows the value's place."""
    if holder["schema"]["type"] == "default":
        holder = holder["schema"]
    listed = holder["schema"]
    while listed["type"] != "list" and "schema" in listed:
        listed = listed["schema"]
    if not field.nested and field.is_list and "items_schema" in listed:
        element = _after(listed["items_schema"], validate_element, field)
        listed["items_schema"] = element
    if field.is_list or not field.nested:
        check = validate_count if field.is_list else validate_element
        holder["schema"] = _after(holder["schema"], check, field)


def _after(
    schema: Any, check: Callable[[Any, FieldInfo], None], field: FieldInfo
) -> Any:
    def checked(value: Any) -> Any:
        check(value, field)
        return value

    function = {"type": "no-info", "function": checked}
    return {"type": "function-after", "function": function, "schema": schema}


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
