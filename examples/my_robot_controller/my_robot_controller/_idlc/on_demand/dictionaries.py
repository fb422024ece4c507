"""Messages as dictionaries of what JSON knows, and back."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any

from ..errors import ValidationError
from .typeinfo import FieldInfo, class_of, fields_of, type_name
from .validation import validate


def to_dict(message: Any) -> dict[str, Any]:
    """Return a message's fields by their names on the wire."""
    return _to_dict(message, type_name(type(message)))


def _to_dict(message: Any, name: str) -> dict[str, Any]:
    return {
        field.name: _plain(getattr(message, field.slot), field)
        for field in fields_of(name)
    }


def _plain(value: Any, field: FieldInfo) -> Any:
    if not field.is_list:
        return _plain_element(value, field)
    if field.is_numeric and hasattr(value, "tolist"):
        return value.tolist()
    return [_plain_element(element, field) for element in value]


def _plain_element(value: Any, field: FieldInfo) -> Any:
    if field.nested:
        return _to_dict(value, field.nested)
    if (
        field.primitive is not None
        and field.primitive.code == "c"
        and isinstance(value, bytes)
    ):
        return value[0]
    return value


def from_dict(kind: type, values: dict[str, Any]) -> Any:
    """Return a message of class `kind` from a dictionary as `to_dict` makes it."""
    message = _from_dict(kind, type_name(kind), values, "")
    validate(message)
    return message


def _from_dict(kind: Any, name: str, values: Any, path: str) -> Any:
    if not isinstance(values, dict):
        raise ValidationError(path or "values", f"a dictionary of {name}", values)
    known = {field.name: field for field in fields_of(name)}
    message = kind()
    for key, value in values.items():
        field = known.get(key)
        if field is None:
            problem = f"{name} has no such field{close(str(key), list(known))}"
            raise ValidationError(_join(path, key), "absent", value, problem)
        place = _join(path, field.public)
        _set(message, field, _value(value, field, place), path)
    return message


def _join(path: str, name: object) -> str:
    return f"{path}.{name}" if path else str(name)


def close(name: str, known: list[str]) -> str:
    """Return which known name was perhaps meant, in words that follow a statement."""
    found = get_close_matches(name, known, 1)
    return f"; did you mean {found[0]!r}?" if found else ""


def _set(message: Any, field: FieldInfo, value: Any, path: str) -> None:
    try:
        setattr(message, field.public, value)
    except ValidationError as error:
        raise error.at(_join(path, error.path), ValidationError) from None


def _value(value: Any, field: FieldInfo, path: str) -> Any:
    if not field.is_list:
        return _element(value, field, path)
    if field.is_numeric:
        return value
    if isinstance(value, (str, bytes, dict)) or not hasattr(value, "__iter__"):
        raise ValidationError(path, "a list", value)
    return [_element(one, field, f"{path}[{index}]") for index, one in enumerate(value)]


def _element(value: Any, field: FieldInfo, path: str) -> Any:
    if field.nested:
        return _from_dict(class_of(field.nested), field.nested, value, path)
    primitive = field.primitive
    if primitive is not None and primitive.code == "c" and isinstance(value, int):
        if not 0 <= value <= 255:
            raise ValidationError(path, "an integer from 0 to 255 (byte)", value)
        return bytes([value])
    return value
