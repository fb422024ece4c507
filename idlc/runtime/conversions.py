"""Messages as dictionaries, as dataclasses, and as pydantic checks and writes them.

Also the names that only annotations use: whoever evaluates these comes here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache, partial
from typing import TYPE_CHECKING, Any, TypeAlias, TypedDict, get_type_hints

from .checked import validate, validate_count, validate_element
from .names import ValidationError, owner_of, slot_name
from .typeinfo import FieldInfo, Structure, inner_path, spelling_hint, structure_of

if TYPE_CHECKING:
    import dataclasses
else:
    import typing

    # Python 3.10 has none, and anything that takes an index will do
    Unpack = getattr(typing, "Unpack", typing.Optional)


#: What numeric sequences take.
Integers: TypeAlias = Iterable[int]
Floats: TypeAlias = Iterable[float]
#: The function that receives a message's parts.
Join: TypeAlias = Callable[[list[Any]], Any]


class Options(TypedDict, total=False):
    """The keywords of every constructor besides the fields."""

    #: Raise AssertionError when a wrong value is assigned, as rosidl's classes do.
    check_fields: bool


def to_dict(message: Any) -> dict[str, Any]:
    """Return a message's fields by their names on the wire."""
    return _to_dict(message, structure_of(type(message)))


def _to_dict(message: Any, structure: Structure) -> dict[str, Any]:
    values = {}
    for field in structure.fields:
        value = getattr(message, field.slot)
        if not field.is_list:
            value = _plain(value, field)
        elif field.is_numeric and hasattr(value, "tolist"):
            value = value.tolist()
        else:
            value = [_plain(element, field) for element in value]
        values[field.name] = value
    return values


def _plain(value: Any, field: FieldInfo) -> Any:
    if field.nested:
        return _to_dict(value, field.nested)
    if isinstance(value, int) and not isinstance(value, bool):
        return int(value)  # what YAML knows, of a member of an enum
    is_byte = field.primitive is not None and field.primitive.code == "c"
    return value[0] if is_byte and isinstance(value, bytes) else value


def from_dict(kind: type, values: dict[str, Any]) -> Any:
    """Return a message of class `kind` from a dictionary as `to_dict` makes it."""
    message = _from_dict(kind, structure_of(kind), values, "")
    validate(message)
    return message


def _from_dict(kind: Any, structure: Structure, values: Any, path: str) -> Any:
    if not isinstance(values, dict):
        raise ValidationError(
            path or "values", f"a dictionary of {structure.name}", values
        )
    fields = {field.name: field for field in structure.fields}
    message = kind()
    for key, value in values.items():
        field = fields.get(key)
        if field is None:
            hint = spelling_hint(str(key), list(fields))
            problem = f"{structure.name} has no such field{hint}"
            raise ValidationError(inner_path(path, key), "absent", value, problem)
        place = inner_path(path, field.public)
        made = value
        if not field.is_list:
            made = _element(value, field, place)
        elif not field.is_numeric:
            if isinstance(value, (str, bytes, dict)) or not hasattr(value, "__iter__"):
                raise ValidationError(place, "a list", value)
            made = [
                _element(element, field, f"{place}[{index}]")
                for index, element in enumerate(value)
            ]
        try:
            setattr(message, field.public, made)
        except ValidationError as error:
            raise error.at(inner_path(path, error.path), ValidationError) from None
    return message


def _element(value: Any, field: FieldInfo, path: str) -> Any:
    if field.nested:
        return _from_dict(field.nested.find_class(), field.nested, value, path)
    primitive = field.primitive
    if primitive is not None and primitive.code == "c" and isinstance(value, int):
        if not 0 <= value <= 255:
            raise ValidationError(path, "an integer from 0 to 255 (byte)", value)
        return bytes([value])
    return value


# dataclasses


@cache
def dataclass_params(_kind: Any) -> Any:
    """Return the `__dataclass_params__` of a class, which are those of all."""
    import dataclasses

    model: Any = dataclasses.make_dataclass("Message", [], slots=True)
    return model.__dataclass_params__


def dataclass_fields(kind: Any) -> dict[str, dataclasses.Field[Any]]:
    """Return a class's fields by their Python names, in order.

    They are kept on the generated class, which then needs nobody to ask for them.
    """
    import dataclasses

    if "__dataclass_fields__" in kind.__dict__:  # the base of all messages
        return {}
    owner = owner_of(kind)
    defaults = owner.__init__.__defaults__ or ()
    wire_names = owner._fields_and_field_types
    try:
        types = get_type_hints(owner)
    except ImportError:  # of another package, whose classes only these fields need
        types = owner.__annotations__
    parts: list[Any] = []
    for name, wire, default in zip(
        owner.__match_args__, wire_names, defaults, strict=True
    ):
        field: Any = (
            dataclasses.field(default_factory=partial(_fresh, owner, slot_name(wire)))
            if default is None
            else dataclasses.field(default=default)
        )
        parts.append((name, types[name], field))
    plain = dataclasses.make_dataclass(
        owner.__name__, parts, init=False, repr=False, eq=False
    )
    fields: dict[str, Any] = plain.__dataclass_fields__  # type: ignore[attr-defined]
    owner.__dataclass_fields__ = fields
    if "_arrays." not in "".join(owner.__annotations__.values()):
        # pytest explains field by field what dataclasses made, which it knows by this name
        code = owner.__eq__.__code__
        owner.__eq__.__code__ = code.replace(co_filename="<string>")
    return fields


def _fresh(owner: Any, slot: str) -> Any:
    return getattr(owner(), slot)


# pydantic: a `CoreSchema` is made of dictionaries


def message_schema(cls: Any, reference: Any, handler: Any) -> Any:
    """Return the schema of a message, from the one that it has as a dataclass.

    That may be a reference; what it leads to is changed, because other fields have it, too.
    """
    schema = handler.resolve_ref_schema(reference)
    if schema["type"] == "dataclass":
        own = {field.public: field for field in structure_of(cls).fields}
        for entry in schema["schema"].get("fields", ()):
            if entry["name"] in own:  # subclasses have more
                _check(entry, own[entry["name"]])
        inner = {key: schema[key] for key in schema if key != "ref"}
        shared = {"ref": schema["ref"]} if "ref" in schema else {}
        schema.clear()
        function = {"type": "no-info", "function": _checked}
        schema.update(shared, type="function-wrap", function=function, schema=inner)
    return reference


def _checked(value: Any, make: Any) -> Any:
    """Return the message that pydantic makes of a value; raise ValueError for a wrong one."""
    try:
        message = make(value)
    except (OverflowError, TypeError) as error:
        raise ValueError(str(error)) from None
    if message is value:
        validate(message)
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
    """Return the schema of an array of numbers, from that of a list of them."""
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
