"""Parameters and their values in the words of rclpy, and as messages."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from enum import Enum
from typing import Any

from idlc.robot.nodes.interfaces import standard

_INT64 = range(-(2**63), 2**63)
_ARRAYS = (list, tuple, array)


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
    def from_parameter_value(cls, value: object) -> ParameterType:
        """Return the type of a value, BYTE_ARRAY for an empty list; raise TypeError without one."""
        if value is None:
            return cls.NOT_SET
        for kind, type_ in _SCALARS.items():
            if isinstance(value, kind):
                return type_
        for kind, type_ in _ELEMENTS.items():
            if isinstance(value, _ARRAYS) and all(isinstance(each, kind) for each in value):
                return type_
        raise TypeError(
            f"a parameter must be a bool, int, float, str, or a list of such values, not {value!r}"
        )

    def check(self, value: object) -> bool:
        """Return whether the value is of this type; an empty list is of each array type."""
        if isinstance(value, _ARRAYS) and not len(value):
            return self.is_array
        try:
            type_ = self.from_parameter_value(value)
        except TypeError:
            return False
        if type_ is not self:
            return False
        if self in (ParameterType.INTEGER, ParameterType.INTEGER_ARRAY):
            return all(each in _INT64 for each in ([value] if isinstance(value, int) else value))  # type: ignore[attr-defined]
        return self is not ParameterType.BYTE_ARRAY or {*map(len, value)} == {1}  # type: ignore[call-overload]

    @property
    def is_array(self) -> bool:
        """True if the values are lists."""
        return self.value >= ParameterType.BYTE_ARRAY.value


_SCALARS: dict[type, ParameterType] = {
    bool: ParameterType.BOOL,  # before int, of which it is a subclass
    int: ParameterType.INTEGER,
    float: ParameterType.DOUBLE,
    str: ParameterType.STRING,
}
_ELEMENTS: dict[type, ParameterType] = {
    bytes: ParameterType.BYTE_ARRAY,
    bool: ParameterType.BOOL_ARRAY,
    int: ParameterType.INTEGER_ARRAY,
    float: ParameterType.DOUBLE_ARRAY,
    str: ParameterType.STRING_ARRAY,
}


class Parameter:
    """A name with a value, which is `None` for the type NOT_SET.

    Raises TypeError or ValueError if there is no such type, or the value is of another one.
    """

    __slots__ = ("name", "type_", "value")

    Type = ParameterType

    def __init__(self, name: str, type_: ParameterType | None = None, value: Any = None) -> None:
        if type_ is None:
            type_ = ParameterType.from_parameter_value(value)
        if not isinstance(type_, ParameterType):
            raise TypeError(f"the type of `{name}` is a member of Parameter.Type, not {type_!r}")
        if not type_.check(value):
            raise ValueError(f"`{name}` is of type {type_.name}, which {value!r} is not")
        self.name = name
        self.type_ = type_
        self.value = value

    def __repr__(self) -> str:
        return f"Parameter({self.name!r}, {self.type_.name}, {self.value!r})"

    @classmethod
    def from_parameter_msg(cls, message: Any) -> Parameter:
        """Return the parameter in a message; raise ValueError if its type does not exist."""
        return cls(
            message.name,
            ParameterType(message.value.type),
            parameter_value_to_python(message.value),
        )

    def get_parameter_value(self) -> Any:
        """Return the value as rcl_interfaces/msg/ParameterValue."""
        message = message_of("ParameterValue", type=self.type_.value)
        if self.type_ is not ParameterType.NOT_SET:
            value = [*self.value] if self.type_.is_array else self.value
            setattr(message, f"{self.type_.name.lower()}_value", value)
        return message

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
    if type_ is ParameterType.NOT_SET:
        return None
    value = getattr(message, f"{type_.name.lower()}_value")
    return [*value] if type_.is_array else value


class ParameterException(Exception):  # noqa: N818 - rclpy's name
    """The base of the errors about parameters."""

    def __init__(self, problem: str, names: str | Sequence[str]) -> None:
        shown = [names] if isinstance(names, str) else names
        super().__init__(f"{problem}: {', '.join(f'`{name}`' for name in shown)}")


class ParameterNotDeclaredException(ParameterException):
    """A parameter was not declared."""

    def __init__(self, names: str | Sequence[str]) -> None:
        super().__init__("parameter not declared", names)


class ParameterAlreadyDeclaredException(ParameterException):
    """A parameter was declared before."""

    def __init__(self, names: str | Sequence[str]) -> None:
        super().__init__("parameter already declared", names)


class InvalidParameterException(ParameterException):
    """The name of a parameter is not valid."""

    def __init__(self, name: str) -> None:
        super().__init__("invalid name of a parameter", name)


class InvalidParameterValueException(ParameterException):
    """A descriptor or a callback rejects a value; `reason` says why."""

    def __init__(self, name: str, value: object, reason: str) -> None:
        super().__init__(f"{value!r} was rejected ({reason})", name)


class InvalidParameterTypeException(InvalidParameterValueException):
    """A value is of another type than its parameter."""


class ParameterImmutableException(ParameterException):
    """A read-only parameter was to be changed."""

    def __init__(self, name: str) -> None:
        super().__init__("parameter is read-only", name)


class ParameterUninitializedException(ParameterException):
    """A parameter was declared with a type, but has no value."""

    def __init__(self, name: str) -> None:
        super().__init__("parameter has no value", name)
