"""Checks of values: of whole messages, of what codecs refuse, and at each assignment.

Messages check what is assigned to them, as rosidl's classes do, where `check_fields=True` or the
environment asks for it. Each is an instance of a subclass whose fields are properties, so that
all others pay nothing. It refuses what rosidl refuses, and its AssertionError names the field.
"""

from __future__ import annotations

import math
from array import array
from collections import UserList, UserString
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from functools import cache
from typing import Any

from .names import (
    FieldCheckError,
    FieldNameError,
    FieldRangeError,
    FieldTypeError,
    ValidationError,
    owner_of,
)
from .typeinfo import (
    FieldInfo,
    Primitive,
    Structure,
    counted,
    inner_path,
    is_copy,
    spelling_hint,
    structure_of,
)

# checking values


def validate(message: Any, *, wire_only: bool = False) -> None:
    """Raise ValidationError for the first value that its field cannot hold.

    `wire_only` leaves out what the wire does not enforce: the bounds of strings.
    """
    _message(message, structure_of(type(message)), "", wire_only)


def _message(message: Any, structure: Structure, path: str, wire_only: bool) -> None:
    for field in structure.fields:
        place = inner_path(path, field.public)
        if not hasattr(message, field.slot):
            raise ValidationError(path or "message", f"a {structure.name}", message)
        value = getattr(message, field.slot)
        if field.is_list:
            _list(value, field, place, wire_only)
        else:
            validate_element(value, field, place, wire_only)


def _list(values: Any, field: FieldInfo, path: str, wire_only: bool) -> None:
    if isinstance(values, (str, dict)) or not hasattr(values, "__len__"):
        raise ValidationError(path, "a sequence", values)
    validate_count(values, field, path)
    if field.primitive is not None and _holds(values, field.primitive):
        return
    for index, value in enumerate(values):
        validate_element(value, field, f"{path}[{index}]", wire_only)


def validate_count(values: Any, field: FieldInfo, path: str = "") -> None:
    """Raise ValidationError if a field, by default named as it is, cannot hold so many values."""
    path = path or field.public
    if field.size is not None and len(values) != field.size:
        problem = f"has {counted(len(values), 'element')}, needs {field.size}"
        raise ValidationError(path, f"{field.size} elements", values, problem)
    if field.bound is not None and len(values) > field.bound:
        _too_many(path, "element", len(values), field.bound, values)


def _holds(values: Any, primitive: Primitive) -> bool:
    """Return whether an array's own type already says that all elements fit."""
    if primitive.code in "?c":
        return isinstance(values, (bytes, bytearray))
    if isinstance(values, array):
        return values.typecode == primitive.code
    dtype = getattr(values, "dtype", None)
    return dtype is not None and dtype.name == primitive.name and values.ndim == 1


def validate_element(
    value: Any, field: FieldInfo, path: str = "", wire_only: bool = False
) -> None:
    """Raise ValidationError if a field, or a list in it, cannot hold a value."""
    path = path or field.public
    if field.nested:
        _message(value, field.nested, path, wire_only)
    elif field.primitive is not None:
        _primitive(value, field.primitive, path)
    elif not isinstance(value, str):
        raise ValidationError(path, "a str", value)
    else:
        try:
            value.encode()
        except UnicodeEncodeError:
            allowed = "a str without lone surrogates"
            raise ValidationError(path, allowed, value) from None
        bound = None if wire_only else field.text_bound
        if bound is not None and len(value) > bound:
            _too_many(path, "character", len(value), bound, value)


def _too_many(path: str, what: str, count: int, bound: int, value: object) -> None:
    problem = f"has {counted(count, what)}, at most {bound} are allowed"
    raise ValidationError(path, f"at most {counted(bound, what)}", value, problem)


def _primitive(value: Any, primitive: Primitive, path: str) -> None:
    if primitive.code == "?":
        right = isinstance(value, (int, float)) and value in (0, 1)
        right = right or type(value).__name__ in {"bool_", "bool"}
    elif primitive.code == "c":
        right = isinstance(value, bytes) and len(value) == 1
    else:
        right = _is_in_range(value, primitive, path)
    if not right:
        raise ValidationError(path, primitive.allowed, value)


def _is_in_range(value: Any, primitive: Primitive, path: str) -> bool:
    if primitive.code not in "fd":
        try:
            number = value.__index__()
        except (AttributeError, TypeError):
            return False
    else:
        try:
            number = float("" if isinstance(value, (str, bytes)) else value)
        except (TypeError, ValueError, OverflowError):
            allowed = f"a number ({primitive.name})"
            raise ValidationError(path, allowed, value) from None
        if not math.isfinite(number):
            return True
    low, high = primitive.low, primitive.high
    return low is None or high is None or bool(low <= number <= high)


def refused(message: Any, name: str, values: Any, error: Exception) -> ValidationError:
    """Return the error for values that a field of numbers does not take.

    `error` is what Python or numpy said, and one of its kind is returned: rosidl's classes
    raise that.
    """
    fields = structure_of(type(message)).fields
    field = next(field for field in fields if field.public == name)
    assert field.primitive is not None
    kind = field.primitive.name
    failure = ValidationError(name, f"numbers ({kind})", values, f"{error} ({kind})")
    if isinstance(values, (bytes, bytearray)) and field.is_sequence:
        size = field.primitive.size
        problem = f"has {counted(len(values), 'byte')}, needs a multiple of {size}"
        failure = ValidationError(name, "whole numbers of bytes", values, problem)
    elif (
        isinstance(values, (list, tuple))
        or getattr(values, "ndim", 0) == 1
        or not hasattr(values, "__len__")
    ):
        try:
            _list(values, field, name, wire_only=True)
        except ValidationError as exact:
            failure = exact
    raised = ValidationError
    if isinstance(error, OverflowError):
        raised = FieldRangeError
    elif isinstance(error, TypeError) or isinstance(values, (str, dict)):
        raised = FieldTypeError
    return failure.at(failure.path, raised)  # type: ignore[no-any-return]


# messages that check what is assigned

#: rosidl's limits of a float32, which are not quite those of IEEE 754.
_FLOAT32 = 3.402823466e38


def construct(
    message: Any, options: Mapping[str, Any], arguments: dict[str, Any]
) -> bool:
    """Return whether `message` got all its fields here, because it is to check them.

    `options` are the constructor's further keywords, `arguments` its local variables. Raises
    TypeError for an unknown keyword and for a first field of another type: ROS's tools try
    `type(field)(value)`, and go over the fields of a dictionary only after a TypeError.
    """
    kind: Any = type(message)
    unknown = [name for name in options if name != "check_fields"]
    check = bool(options.get("check_fields"))
    fields = structure_of(kind).fields
    if unknown:
        names = [field.public for field in fields]
        hint = spelling_hint(unknown[0], names)
        problem = (
            f"{kind.__name__}() got an unexpected keyword argument {unknown[0]!r}{hint}"
        )
        error = FieldNameError if check else FieldTypeError
        raise error("", "absent", options[unknown[0]], problem)
    owner: Any = owner_of(kind)
    defaults = owner.__init__.__defaults__ or ()
    if not check:
        if fields:
            _check_first(owner, fields[0], arguments[fields[0].public])
        return False
    default = owner(check_fields=False)
    message.__class__ = checked_class(kind)
    for field, without in zip(fields, defaults, strict=True):
        value = arguments[field.public]
        if value is None and without is None:
            value = getattr(default, field.slot)
        elif field.is_sequence and field.is_numeric:
            value = array(field.primitive.code, value)  # type: ignore[union-attr]
        setattr(message, field.public, value)
    return True


def _check_first(owner: Any, field: FieldInfo, value: Any) -> None:
    if value is None and owner.__init__.__defaults__[0] is None:
        return  # the default
    if _converts(owner, field) and not isinstance(value, (str, Mapping)):
        return
    check = _list if field.is_list else validate_element
    try:
        check(value, field, field.public, wire_only=True)
    except ValidationError as error:
        raise error.at(error.path, FieldTypeError) from None


class Checked:
    """The base of the classes whose instances check their fields."""

    __slots__ = ()

    def __reduce_ex__(self, protocol: Any) -> Any:
        plain: Any = type(self).__base__
        slots = owner_of(plain).__slots__
        return _restored, (plain, {slot: getattr(self, slot) for slot in slots})


# pickles name this function and this module
def _restored(kind: type, values: dict[str, Any]) -> Any:
    message = object.__new__(checked_class(kind))
    for slot, value in values.items():
        owner_of(kind).__dict__[slot].__set__(message, value)
    return message


@cache
def checked_class(kind: Any) -> Any:
    """Return the subclass whose fields check the values that are assigned."""
    owner = owner_of(kind)
    namespace: dict[str, Any] = {
        name: getattr(kind, name) for name in ("__module__", "__qualname__", "__doc__")
    }
    for field in structure_of(kind).fields:
        name = field.public if _converts(owner, field) else field.slot
        namespace[field.public] = _property(owner.__dict__[name], field)
    namespace["__slots__"] = ()
    return type.__new__(type(kind), kind.__name__, (kind, Checked), namespace)


def _converts(owner: Any, field: FieldInfo) -> bool:
    """Return whether a class makes lists of the values of a field."""
    is_property = isinstance(owner.__dict__[field.public], property)
    return is_property and not field.is_numeric


def _property(slot: Any, field: FieldInfo) -> property:
    store = slot.__set__

    def setter(message: Any, value: Any) -> None:
        allowed = _refusal(value, field)
        if allowed:
            raise FieldCheckError(field.public, allowed, value)
        if field.is_list and field.is_numeric:
            value = _numbers(value, field)
        store(message, value)

    return property(slot.__get__, setter)


def _numbers(value: Any, field: FieldInfo) -> Any:
    """Return checked values as the field holds them: an array as it is, others copied."""
    assert field.primitive is not None
    if field.is_sequence:
        return value if isinstance(value, array) else array(field.primitive.code, value)
    import numpy as np

    exact = isinstance(value, np.ndarray)
    return value if exact else np.array(value, field.primitive.name)


def _refusal(value: Any, field: FieldInfo) -> str:
    """Return what the field allows if it refuses a value, else nothing."""
    if not field.is_list:
        return _refusal_of_element(value, field)
    if field.is_numeric:
        if field.is_sequence and isinstance(value, array):
            return _refusal_of_array(value, field)
        if field.size is not None and type(value).__module__ == "numpy":
            return _refusal_of_numpy(value, field)
    if not isinstance(value, (Sequence, AbstractSet, UserList)) or isinstance(
        value, (str, UserString)
    ):
        return "a set or sequence"
    if field.size is not None and len(value) != field.size:
        return f"a set or sequence of length {field.size}"
    if field.bound is not None and len(value) > field.bound:
        return f"a set or sequence of length <= {field.bound}"
    refusals = (_refusal_of_element(element, field, listed=True) for element in value)
    return next(
        (f"a set or sequence, each value {text}" for text in refusals if text), ""
    )


def _refusal_of_array(value: array[Any], field: FieldInfo) -> str:
    assert field.primitive is not None
    if value.typecode != field.primitive.code:
        return f"an array.array of {field.primitive.code!r}"
    if field.bound is not None and len(value) > field.bound:
        return f"an array.array of length <= {field.bound}"
    return ""


def _refusal_of_numpy(value: Any, field: FieldInfo) -> str:
    assert field.primitive is not None
    if value.dtype.name == field.primitive.name and value.size == field.size:
        return ""
    return f"{field.size} numbers ({field.primitive.name})"


def _refusal_of_element(value: Any, field: FieldInfo, *, listed: bool = False) -> str:
    if field.nested:
        kind = field.nested.find_class()
        right = isinstance(value, kind) or is_copy(type(value), kind)
        return "" if right else f"a {field.nested.name}"
    if field.text:
        types: Any = str if listed else (str, UserString)
        if not isinstance(value, types):
            return "a str"
        if field.text_bound is not None and len(value) > field.text_bound:
            return f"a str not longer than {field.text_bound}"
        return ""
    assert field.primitive is not None
    return _refusal_of_primitive(value, field.primitive, listed=listed)


def _refusal_of_primitive(value: Any, primitive: Primitive, *, listed: bool) -> str:
    code = primitive.code
    if code == "?":
        right = isinstance(value, bool)
    elif code == "c":
        types: Any = bytes if listed else (bytes, bytearray)
        right = isinstance(value, types) and (listed or len(value) == 1)
    elif code in "fd":
        if not isinstance(value, float):
            return f"a float ({primitive.name})"
        right = code == "d" or not _FLOAT32 < abs(value) < math.inf
        primitive = primitive._replace(low=-_FLOAT32, high=_FLOAT32)
    else:
        assert primitive.low is not None
        assert primitive.high is not None
        right = isinstance(value, int) and primitive.low <= value <= primitive.high
    return "" if right else primitive.allowed
