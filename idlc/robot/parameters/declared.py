"""The methods of nodes for parameters, in the words of rclpy, and the services for parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from copy import copy
from functools import partial
from typing import Any

from idlc.robot.nodes.interfaces import standard
from idlc.robot.parameters import values
from idlc.robot.parameters.values import Parameter, ParameterType, message_of
from idlc.robot.qos import qos_profile_parameters

#: Values that differ by less, relatively, are the same end or step of a range.
TOLERANCE = 1e-6
_SIM_TIME = "use_sim_time"
_RANGES = {ParameterType.INTEGER: "integer_range", ParameterType.DOUBLE: "floating_point_range"}


class HasParameters:
    """A node, as far as its parameters go; descriptors and results are messages of rcl_interfaces.

    Methods raise the exceptions that rclpy raises.
    """

    get_clock: Callable[..., Any]
    get_fully_qualified_name: Callable[..., str]
    use_sim_time: Callable[[bool], None]
    _parameter_events: Any

    def _begin_parameters(
        self, overrides: Mapping[str, Parameter], *, allow_undeclared: bool, declare_overrides: bool
    ) -> None:
        """Prepare a new node; `overrides` replace the values of declarations."""
        self._parameter_overrides = overrides
        self._allow_undeclared_parameters = allow_undeclared
        self._parameter_descriptors: dict[str, Any] = {}
        self._on_set_callbacks: list[Callable[[list[Parameter]], Any]] = []
        # declared without an event or a descriptor, so that a node that uses no parameters starts
        # without the messages about them
        simulated = overrides[_SIM_TIME].value if _SIM_TIME in overrides else False
        self._parameters = {_SIM_TIME: Parameter(_SIM_TIME, ParameterType.BOOL, simulated)}
        self.use_sim_time(simulated)
        if declare_overrides:
            new = [(name, each.value) for name, each in overrides.items() if name != _SIM_TIME]
            self.declare_parameters("", new)

    # declarations

    def declare_parameter(self, name: str, value: Any = None, descriptor: Any = None) -> Parameter:
        """Declare a parameter with a default value, or with a `Parameter.Type` and no value."""
        return self.declare_parameters("", [(name, value, descriptor)])[0]

    def declare_parameters(
        self, namespace: str, parameters: Iterable[Sequence[Any]]
    ) -> list[Parameter]:
        """Declare parameters, each as (name, value or type, descriptor), and return them."""
        declared: dict[str, tuple[Parameter, Any]] = {}
        for short, *rest in parameters:
            name = f"{namespace}.{short}" if namespace else short
            if not short:
                raise values.InvalidParameterException(f"invalid name of a parameter: `{name}`")
            if name in self._parameters:
                raise values.ParameterAlreadyDeclaredException(f"already declared: `{name}`")
            value, given = [*rest, None, None][:2]
            descriptor = copy(given) or message_of("ParameterDescriptor")  # one may serve several
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
            declared[name] = parameter, descriptor
        for name, (parameter, descriptor) in declared.items():
            self._change([parameter], {name: descriptor})
        return [self._parameters[name] for name in declared]

    # values

    def _known_parameter(self, name: str) -> Parameter:
        """Return a parameter, with or without a value."""
        if name not in self._parameters and not self._allow_undeclared_parameters:
            raise values.ParameterNotDeclaredException(f"parameter not declared: `{name}`")
        return self._parameters.get(name) or Parameter(name)

    def has_parameter(self, name: str) -> bool:
        """Return whether a parameter is declared."""
        return name in self._parameters

    def get_parameter(self, name: str) -> Parameter:
        """Return a parameter."""
        parameter = self._known_parameter(name)
        if parameter.value is None and not self.describe_parameter(name).dynamic_typing:
            raise values.ParameterUninitializedException(f"parameter has no value: `{name}`")
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
        descriptors = {each.name: self.describe_parameter(each.name) for each in parameter_list}
        try:
            self._change(parameter_list, descriptors)
        except values.InvalidParameterValueException as error:
            return message_of("SetParametersResult", successful=False, reason=str(error))
        return message_of("SetParametersResult", successful=True)

    def _change(self, parameters: list[Parameter], descriptors: dict[str, Any]) -> None:
        """Check and set parameters, and publish the changes."""
        for parameter in parameters:
            _check(parameter, descriptors[parameter.name], parameter.name not in self._parameters)
        for callback in self._on_set_callbacks:
            result = callback(parameters)
            if not getattr(result, "successful", False):
                reason = getattr(result, "reason", "a callback returned no SetParametersResult")
                raise values.InvalidParameterValueException(reason)
        event = message_of("ParameterEvent", node=self.get_fully_qualified_name())
        event.stamp = self.get_clock().now().to_msg()
        for parameter in parameters:
            is_new = self.get_parameter_or(parameter.name).value is None
            changes = event.new_parameters if is_new else event.changed_parameters
            changes.append(parameter.to_parameter_msg())
        self._parameters.update({parameter.name: parameter for parameter in parameters})
        self._parameter_descriptors.update(descriptors)
        self.use_sim_time(self._parameters[_SIM_TIME].value)
        self._parameter_events.publish(event)

    def add_on_set_parameters_callback(self, callback: Callable[[list[Parameter]], Any]) -> None:
        """Call `callback` with parameters to be set; it returns a SetParametersResult."""
        self._on_set_callbacks.insert(0, callback)

    # descriptions

    def describe_parameter(self, name: str) -> Any:
        """Return the descriptor of a parameter."""
        parameter = self._known_parameter(name)
        descriptor = self._parameter_descriptors.get(name) or message_of(
            "ParameterDescriptor", name=name, dynamic_typing=name not in self._parameters
        )
        if descriptor.dynamic_typing or not descriptor.type:
            descriptor.type = parameter.type_.value
        return descriptor

    def list_parameters(self, prefixes: Iterable[str], depth: int) -> Any:
        """Return a ListParametersResult of the names with any of the prefixes, or of all.

        A name has at most `depth` parts more than its prefix, or any number if `depth` is 0.
        """
        chosen = {*prefixes} or {""}
        names = []
        for name in self._parameters:
            parts = name.split(".")
            starts = (".".join(parts[:length]) for length in range(len(parts) + 1))
            below = [len(parts) - at for at, start in enumerate(starts) if start in chosen]
            if below and (not depth or below[-1] <= depth):
                names.append(name)
        above = {name.rpartition(".")[0]: None for name in names if "." in name}
        return message_of("ListParametersResult", names=names, prefixes=[*above])


def _check(parameter: Parameter, descriptor: Any, is_new: bool) -> None:
    """Raise an InvalidParameterValueException if a descriptor forbids a value."""
    name, type_, value = parameter.name, parameter.type_, parameter.value
    if descriptor.read_only and not is_new:
        raise values.InvalidParameterValueException(f"`{name}` is read-only")
    is_free = descriptor.dynamic_typing or (is_new and value is None)
    if not is_free and type_.value != descriptor.type:
        right = ParameterType(descriptor.type).name
        raise values.InvalidParameterTypeException(f"`{name}` is {right}, not {type_.name}")
    for each in getattr(descriptor, _RANGES.get(type_, ""), ()):
        low, high = sorted((each.from_value, each.to_value))
        if not _is_inside(value, low, high, each.step):
            limits = f"from {low} to {high}" + (f" in steps of {each.step}" if each.step else "")
            raise values.InvalidParameterValueException(f"`{name}` must be {limits}, not {value}")


def _is_inside(value: float, low: float, high: float, step: float) -> bool:
    if isinstance(value, int):
        return value == high or value in range(int(low), int(high) + 1, int(step) or 1)
    is_end = any(math.isclose(value, end, rel_tol=TOLERANCE) for end in (low, high))
    rest = (value - low) % step if step else 0.0
    is_step = min(rest, step - rest) <= TOLERANCE * max(abs(value), step)
    return is_end or (low < value < high and is_step)


# services


def add_services(node: HasParameters, create_service: Callable[..., Any]) -> None:
    """Create the six services of a node; their messages are compiled for the first request."""
    for name, answer in _ANSWERS.items():
        kind = standard(f"rcl_interfaces/srv/{name.title().replace('_', '')}")
        create_service(kind, f"~/{name}", partial(answer, node), qos_profile=qos_profile_parameters)


def _read(get: Callable[..., Any], field: str, node: Any, request: Any, response: Any) -> Any:
    """Answer with an entry for each name, or with none if one of the parameters has none."""
    with suppress(values.ParameterException):
        setattr(response, field, [get(node, name) for name in request.names])
    return response


def _value(node: HasParameters, name: str) -> Any:
    return node.get_parameter(name).get_parameter_value()


def _list(node: HasParameters, request: Any, response: Any) -> Any:
    response.result = node.list_parameters(request.prefixes, request.depth)
    return response


def _set(node: HasParameters, request: Any, response: Any) -> Any:
    response.results = [_set_all(node, [message]) for message in request.parameters]
    return response


def _set_atomically(node: HasParameters, request: Any, response: Any) -> Any:
    response.result = _set_all(node, request.parameters)
    return response


def _set_all(node: HasParameters, messages: list[Any]) -> Any:
    try:
        return node.set_parameters_atomically([*map(Parameter.from_parameter_msg, messages)])
    except (values.ParameterException, ValueError) as error:
        return message_of("SetParametersResult", successful=False, reason=str(error))


#: The services, in the order of rclpy, so that ids are equal.
_ANSWERS: dict[str, Callable[..., Any]] = {
    "describe_parameters": partial(_read, HasParameters.describe_parameter, "descriptors"),
    "get_parameters": partial(_read, _value, "values"),
    "get_parameter_types": partial(_read, HasParameters.get_parameter_type, "types"),
    "list_parameters": _list,
    "set_parameters": _set,
    "set_parameters_atomically": _set_atomically,
}
