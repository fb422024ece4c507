"""Parameters in the words of rclpy: values, the methods of nodes, and the six services."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from copy import copy
from enum import Enum
from functools import partial
from itertools import chain
from typing import Any, TypeAlias

from idlc.robot.errors import RobotError
from idlc.robot.nodes.interfaces import standard
from idlc.robot.qos import qos_profile_parameters

_ARRAYS = (list, tuple, array)
#: The classes of values or elements, in the order of the types.
_CLASSES = (type(None), bool, int, float, str, bytes, bool, int, float, str)
#: Values that differ by less, relatively, are the same end or step of a range.
TOLERANCE = 1e-6
_SIM_TIME = "use_sim_time"
#: The services of parameters that a node has.
PARAMETER_SERVICES = (
    "describe_parameters",
    "get_parameters",
    "get_parameter_types",
    "list_parameters",
    "set_parameters",
    "set_parameters_atomically",
)


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
        is_array, kind = isinstance(value, _ARRAYS), _CLASSES[self.value]
        elements = value if is_array else [value]
        fits = self.name.endswith("_ARRAY") is is_array
        return fits and all(_is_element(each, kind) for each in elements)


_RANGES = {ParameterType.INTEGER: "integer_range", ParameterType.DOUBLE: "floating_point_range"}


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
        if self.type_ not in [each for each in ParameterType if each.check(value)]:
            raise ValueError(f"`{name}` is of type {self.type_}, which {value!r} is not")

    @classmethod
    def from_parameter_msg(cls, message: Any) -> Parameter:
        """Return the parameter in a message; raise ValueError if its type does not exist."""
        type_ = ParameterType(message.value.type)
        return cls(message.name, type_, parameter_value_to_python(message.value))

    def get_parameter_value(self) -> Any:
        """Return the value as rcl_interfaces/msg/ParameterValue."""
        value = {} if self.value is None else {f"{self.type_.name.lower()}_value": self.value}
        return _message("ParameterValue", type=self.type_.value, **value)

    def to_parameter_msg(self) -> Any:
        """Return the parameter as rcl_interfaces/msg/Parameter."""
        return _message("Parameter", name=self.name, value=self.get_parameter_value())


def _message(name: str, /, **values: Any) -> Any:
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


#: Called with the parameters to be set, or that were set.
SetCallback: TypeAlias = Callable[[list[Parameter]], Any]


class HasParameters:
    """A node, as far as its parameters go; descriptors and results are messages of rcl_interfaces.

    Methods raise the exceptions that rclpy raises.
    """

    get_clock: Callable[..., Any]
    get_fully_qualified_name: Callable[..., str]
    use_sim_time: Callable[[bool], None]
    _parameter_events: Any

    def _begin_parameters(
        self, overrides: dict[str, Parameter], *, allow_undeclared: bool, declare_overrides: bool
    ) -> None:
        """Prepare a new node; `overrides` replace the values of declarations."""
        self._parameter_overrides = overrides
        self._allow_undeclared_parameters = allow_undeclared
        self._parameter_descriptors: dict[str, Any] = {}
        self._pre_set_callbacks: list[SetCallback] = []
        self._on_set_callbacks: list[SetCallback] = []
        self._post_set_callbacks: list[SetCallback] = []
        # declared without an event or a descriptor, so that a node that uses no parameters starts
        # without the messages about them
        simulated = overrides.pop(_SIM_TIME, Parameter(_SIM_TIME, value=False))
        if simulated.type_ is not ParameterType.BOOL:
            raise RobotError(f"`{_SIM_TIME}` is not a bool", f"write `-p {_SIM_TIME}:=true`")
        self._parameters = {_SIM_TIME: simulated}
        self.use_sim_time(simulated.value)
        if declare_overrides:
            self.declare_parameters("", [(name, each.value) for name, each in overrides.items()])

    # declarations

    def declare_parameter(self, name: str, value: Any = None, descriptor: Any = None) -> Parameter:
        """Declare a parameter with a default value, or with a `Parameter.Type` and no value."""
        if not name:
            raise InvalidParameterException("a parameter must have a name")
        if name in self._parameters:
            raise ParameterAlreadyDeclaredException(f"already declared: `{name}`")
        descriptor = copy(descriptor) or _message("ParameterDescriptor")  # one may serve several
        has_type = isinstance(value, ParameterType)
        type_ = value if has_type else ParameterType.from_parameter_value(value)
        if type_ is ParameterType.NOT_SET and not descriptor.dynamic_typing:
            raise ValueError(f"`{name}` has neither a value nor a type nor `dynamic_typing`")
        descriptor.name, descriptor.type = name, type_.value
        override = self._parameter_overrides.get(name)
        if override or has_type:
            value = override and override.value
        # an empty list is of each type of arrays
        parameter = Parameter(name, type_ if type_.check(value) else None, value)
        self._change([parameter], {name: descriptor})
        return parameter

    def declare_parameters(
        self, namespace: str, parameters: Iterable[Sequence[Any]]
    ) -> list[Parameter]:
        """Declare parameters, each as (name, value or type, descriptor), and return them."""
        prefix = namespace and f"{namespace}."
        return [self.declare_parameter(prefix + name, *rest) for name, *rest in parameters]

    # values

    def _known_parameter(self, name: str) -> Parameter:
        """Return a parameter, with or without a value."""
        if name not in self._parameters and not self._allow_undeclared_parameters:
            raise ParameterNotDeclaredException(f"parameter not declared: `{name}`")
        return self._parameters.get(name) or Parameter(name)

    def has_parameter(self, name: str) -> bool:
        """Return whether a parameter is declared."""
        return name in self._parameters

    def get_parameter(self, name: str) -> Parameter:
        """Return a parameter."""
        parameter = self._known_parameter(name)
        if parameter.value is None and not self.describe_parameter(name).dynamic_typing:
            raise ParameterUninitializedException(f"parameter has no value: `{name}`")
        return parameter

    def get_parameters(self, names: Iterable[str]) -> list[Parameter]:
        """Return parameters."""
        return [self.get_parameter(name) for name in names]

    def get_parameter_or(self, name: str, alternative_value: Parameter | None = None) -> Parameter:
        """Return a parameter, or the alternative if it has no value."""
        parameter = self._parameters.get(name) or Parameter(name)
        return parameter if parameter.value is not None else alternative_value or parameter

    def get_parameter_type(self, name: str) -> int:
        """Return the type of a parameter, as a number of rcl_interfaces/msg/ParameterType."""
        return int(self._known_parameter(name).type_.value)

    def set_parameters(self, parameter_list: Iterable[Parameter]) -> list[Any]:
        """Set parameters one by one, and return their results."""
        return [self.set_parameters_atomically([parameter]) for parameter in parameter_list]

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> Any:
        """Set all parameters or none, and return the result."""
        if self._pre_set_callbacks:
            lists = [callback(parameter_list) for callback in self._pre_set_callbacks]
            parameter_list = [*chain.from_iterable(lists)]
            if not parameter_list:
                reason = "the callbacks before setting left no parameters"
                return _message("SetParametersResult", successful=False, reason=reason)
        descriptors = {each.name: self.describe_parameter(each.name) for each in parameter_list}
        try:
            self._change(parameter_list, descriptors)
        except InvalidParameterValueException as error:
            return _message("SetParametersResult", successful=False, reason=str(error))
        return _message("SetParametersResult", successful=True)

    def _change(self, parameters: list[Parameter], descriptors: dict[str, Any]) -> None:
        """Check and set parameters, and publish the changes."""
        for parameter in parameters:
            _check(parameter, descriptors[parameter.name], parameter.name not in self._parameters)
        for callback in self._on_set_callbacks:
            result = callback(parameters)
            if not getattr(result, "successful", False):
                reason = getattr(result, "reason", "a callback returned no SetParametersResult")
                raise InvalidParameterValueException(reason)
        event = _message("ParameterEvent", node=self.get_fully_qualified_name())
        event.stamp = self.get_clock().now().to_msg()
        for parameter in parameters:
            is_new = self.get_parameter_or(parameter.name).value is None
            changes = event.new_parameters if is_new else event.changed_parameters
            changes.append(parameter.to_parameter_msg())
        self._parameters.update({parameter.name: parameter for parameter in parameters})
        self._parameter_descriptors.update(descriptors)
        self.use_sim_time(self._parameters[_SIM_TIME].value)
        self._parameter_events.publish(event)
        for callback in self._post_set_callbacks:
            callback(parameters)

    # the newest callback is called first

    def add_pre_set_parameters_callback(self, callback: SetCallback) -> None:
        """Call `callback` with parameters to be set; it returns the parameters to set instead."""
        self._pre_set_callbacks.insert(0, callback)

    def add_on_set_parameters_callback(self, callback: SetCallback) -> None:
        """Call `callback` with parameters to be set; it returns a SetParametersResult."""
        self._on_set_callbacks.insert(0, callback)

    def add_post_set_parameters_callback(self, callback: SetCallback) -> None:
        """Call `callback` with parameters that were set."""
        self._post_set_callbacks.insert(0, callback)

    def remove_pre_set_parameters_callback(self, callback: SetCallback) -> None:
        """Undo `add_pre_set_parameters_callback`; raise ValueError if it was not called."""
        self._pre_set_callbacks.remove(callback)

    def remove_on_set_parameters_callback(self, callback: SetCallback) -> None:
        """Undo `add_on_set_parameters_callback`; raise ValueError if it was not called."""
        self._on_set_callbacks.remove(callback)

    def remove_post_set_parameters_callback(self, callback: SetCallback) -> None:
        """Undo `add_post_set_parameters_callback`; raise ValueError if it was not called."""
        self._post_set_callbacks.remove(callback)

    def describe_parameter(self, name: str) -> Any:
        """Return the descriptor of a parameter."""
        parameter = self._known_parameter(name)
        descriptor = self._parameter_descriptors.get(name) or _message(
            "ParameterDescriptor", name=name, dynamic_typing=name not in self._parameters
        )
        descriptor.type = parameter.type_.value or descriptor.type
        return descriptor

    # services

    def _serve_parameters(self, create_service: Callable[..., Any]) -> None:
        """Create the six services; their messages are compiled for the first request."""
        # in the order of rclpy, so that ids are equal
        answers = (
            partial(_map, self.describe_parameter, "names", "descriptors"),
            partial(_map, self._get_value, "names", "values"),
            partial(_map, self.get_parameter_type, "names", "types"),
            self._list,
            partial(_map, self._set, "parameters", "results"),
            self._set_atomically,
        )
        for name, answer in zip(PARAMETER_SERVICES, answers, strict=True):
            kind = standard(f"rcl_interfaces/srv/{name.title().replace('_', '')}")
            create_service(kind, f"~/{name}", answer, qos_profile=qos_profile_parameters)

    def _get_value(self, name: str) -> Any:
        return self.get_parameter(name).get_parameter_value()

    def _list(self, request: Any, response: Any) -> Any:
        """Answer with the names with any of the prefixes, or with all names.

        A name has at most `depth` parts more than its prefix, or any number if `depth` is 0.
        """
        prefixes, names = {*request.prefixes} or {""}, response.result.names
        for name in self._parameters:
            parts = name.split(".")
            first = max(len(parts) - (request.depth or len(parts)), 0)
            if any(".".join(parts[:length]) in prefixes for length in range(first, len(parts) + 1)):
                names.append(name)
        above = {name.rpartition(".")[0]: None for name in names if "." in name}
        response.result.prefixes = [*above]
        return response

    def _set(self, *messages: Any) -> Any:
        try:
            return self.set_parameters_atomically([*map(Parameter.from_parameter_msg, messages)])
        except (ParameterException, ValueError) as error:
            return _message("SetParametersResult", successful=False, reason=str(error))

    def _set_atomically(self, request: Any, response: Any) -> Any:
        response.result = self._set(*request.parameters)
        return response


def _check(parameter: Parameter, descriptor: Any, is_new: bool) -> None:
    """Raise an InvalidParameterValueException if a descriptor forbids a value."""
    name, type_, value = parameter.name, parameter.type_, parameter.value
    if descriptor.read_only and not is_new:
        raise InvalidParameterValueException(f"`{name}` is read-only")
    is_free = descriptor.dynamic_typing or (is_new and value is None)
    if not is_free and type_.value != descriptor.type:
        right = ParameterType(descriptor.type).name
        raise InvalidParameterTypeException(f"`{name}` is {right}, not {type_.name}")
    for each in getattr(descriptor, _RANGES.get(type_, ""), ()):
        low, high = sorted((each.from_value, each.to_value))
        if not _is_inside(value, low, high, each.step):
            limits = f"from {low} to {high}" + (f" in steps of {each.step}" if each.step else "")
            raise InvalidParameterValueException(f"`{name}` must be {limits}, not {value}")


def _is_inside(value: float, low: float, high: float, step: float) -> bool:
    if isinstance(value, int):
        return value == high or value in range(int(low), int(high) + 1, int(step) or 1)
    is_end = any(math.isclose(value, end, rel_tol=TOLERANCE) for end in (low, high))
    rest = (value - low) % step if step else 0.0
    is_step = min(rest, step - rest) <= TOLERANCE * max(abs(value), step)
    return is_end or (low < value < high and is_step)


def _map(get: Callable[..., Any], source: str, target: str, request: Any, response: Any) -> Any:
    """Answer with an entry for each name or parameter, or with none if one has none."""
    with suppress(ParameterException):
        setattr(response, target, [get(each) for each in getattr(request, source)])
    return response
