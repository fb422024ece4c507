"""Parameters and their values in the words of rclpy, and as messages."""

from __future__ import annotations

from array import array
from enum import Enum
from typing import Any

from idlc.robot.nodes.interfaces import standard

_ARRAYS = (list, tuple, array)
#: The kinds of elements, in the order of the types of arrays.
_ELEMENTS: tuple[Any, ...] = (bytes, bool, int, float, str)


class ParameterType(Enum):
    """The type of a parameter; the numbers are those of rcl_interfaces/msg/ParameterType."""

    NOT_SET = 0
    BOOL = 1
    INTEGER = 2
    DOUBLE = 3
    STRING = 4
    BYTE_ARRAY = 5
    BOOL_ARRAY = 6
    INTEGER_ARRAY = 7
    DOUBLE_ARRAY = 8
    STRING_ARRAY = 9

    @classmethod
    def from_parameter_value(cls, value: Any) -> ParameterType:
        """Return the type of a value, BYTE_ARRAY for an empty list; raise TypeError without one."""
        for type_ in cls:
            if type_.check(value):
                return type_
        raise TypeError(f"{value!r} is not a bool, int, float, str or list of one of these")

    def check(self, value: Any) -> bool:
        """Return whether the value is of this type; an empty list is of each array type."""
        if self is ParameterType.NOT_SET:
            return value is None
        kind = _ELEMENTS[self.value % len(_ELEMENTS)]
        if self.value >= ParameterType.BYTE_ARRAY.value:
            return isinstance(value, _ARRAYS) and all(_is_element(each, kind) for each in value)
        return _is_element(value, kind)


def _is_element(value: Any, kind: Any) -> bool:
    if kind is int:
        return isinstance(value, int) and not isinstance(value, bool) and -(2**63) <= value < 2**63
    return isinstance(value, kind) and (kind is not bytes or len(value) == 1)


class Parameter:
    """A name with a value, which is `None` for the type NOT_SET.

    Raises TypeError or ValueError if there is no such type, or the value is of another one.
    """

    Type = ParameterType

    def __init__(self, name: str, type_: ParameterType | None = None, value: Any = None) -> None:
        self.name = name
        self.type_ = ParameterType.from_parameter_value(value) if type_ is None else type_
        self.value = value
        if not isinstance(self.type_, ParameterType):
            raise TypeError(f"the type of `{name}` is a member of Parameter.Type, not {type_!r}")
        if not self.type_.check(value):
            raise ValueError(f"`{name}` is of type {self.type_.name}, which {value!r} is not")

    @classmethod
    def from_parameter_msg(cls, message: Any) -> Parameter:
        """Return the parameter in a message; raise ValueError if its type does not exist."""
        type_ = ParameterType(message.value.type)
        return cls(message.name, type_, parameter_value_to_python(message.value))

    def get_parameter_value(self) -> Any:
        """Return the value as rcl_interfaces/msg/ParameterValue."""
        value = {} if self.value is None else {f"{self.type_.name.lower()}_value": self.value}
        return message_of("ParameterValue", type=self.type_.value, **value)

    def to_parameter_msg(self) -> Any:
        """Return the parameter as rcl_interfaces/msg/Parameter."""
        return message_of("Parameter", name=self.name, value=self.get_parameter_value())


def message_of(name: str, /, **values: Any) -> Any:
    """Return a message of rcl_interfaces."""
    return standard(f"rcl_interfaces/msg/{name}").kind(**values)


def parameter_value_to_python(message: Any) -> Any:
    """Return the value in rcl_interfaces/msg/ParameterValue; arrays become lists.

    Raises ValueError if the type of the value does not exist.
    """
    type_ = ParameterType(message.type)
    value: Any = getattr(message, f"{type_.name.lower()}_value", None)
    return [*value] if type_.name.endswith("_ARRAY") else value


class ParameterException(Exception):  # noqa: N818 - rclpy's name
    """The base of the errors about parameters."""


class ParameterNotDeclaredException(ParameterException):
    """A parameter was not declared."""


class ParameterAlreadyDeclaredException(ParameterException):
    """A parameter was declared before."""


class InvalidParameterException(ParameterException):
    """The name of a parameter is not valid."""


class InvalidParameterValueException(ParameterException):
    """A descriptor or a callback rejects a value."""


class InvalidParameterTypeException(InvalidParameterValueException):
    """A value is of another type than its parameter."""


class ParameterUninitializedException(ParameterException):
    """A parameter was declared with a type, but has no value."""
