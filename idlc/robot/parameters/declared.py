"""The methods of nodes that declare, set and describe parameters, in the words of rclpy."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from idlc.robot.nodes.interfaces import standard
from idlc.robot.parameters.values import (
    InvalidParameterException,
    InvalidParameterTypeException,
    InvalidParameterValueException,
    Parameter,
    ParameterAlreadyDeclaredException,
    ParameterImmutableException,
    ParameterNotDeclaredException,
    ParameterType,
    ParameterUninitializedException,
    message_of,
    parameter_value_to_python,
)

#: Values that differ by less, relatively, are the same end or step of a range.
TOLERANCE = 1e-6
_WRONG_TYPE = "wrong type"
_SIM_TIME = "use_sim_time"

Callback = Callable[[list[Parameter]], Any]


class HasParameters:
    """A node, as far as its parameters go; descriptors and results are messages of rcl_interfaces.

    Methods raise the exceptions that rclpy raises.
    """

    if TYPE_CHECKING:
        get_clock: Callable[..., Any]
        get_fully_qualified_name: Callable[..., str]
        use_sim_time: Callable[[bool], None]
        _parameter_events: Any

    def _begin_parameters(
        self,
        overrides: Mapping[str, Parameter],
        *,
        allow_undeclared: bool,
        declare_overrides: bool,
    ) -> None:
        """Prepare a new node; `overrides` replace the values of declarations."""
        self._parameter_overrides = overrides
        self._allow_undeclared_parameters = allow_undeclared
        self._parameters: dict[str, Parameter] = {}
        self._parameter_descriptors: dict[str, Any] = {}
        self._pre_set_callbacks: list[Callback] = []
        self._on_set_callbacks: list[Callback] = []
        self._post_set_callbacks: list[Callback] = []
        # declared without an event, and with a descriptor made on demand, so that a node that uses
        # no parameters starts without the messages about them
        simulated = overrides.get(_SIM_TIME) or Parameter(_SIM_TIME, value=False)
        if simulated.type_ is not ParameterType.BOOL:
            raise InvalidParameterTypeException(_SIM_TIME, simulated.value, "it is a BOOL")
        self._parameters[_SIM_TIME] = simulated
        self.use_sim_time(simulated.value)
        if declare_overrides:
            new = [(name, each.value) for name, each in overrides.items() if name != _SIM_TIME]
            self.declare_parameters("", new)

    # declarations

    def declare_parameter(
        self,
        name: str,
        value: Any = None,
        descriptor: Any = None,
        ignore_override: bool = False,
    ) -> Parameter:
        """Declare a parameter with a default value, or with a `Parameter.Type` and no value."""
        return self.declare_parameters("", [(name, value, descriptor)], ignore_override)[0]

    def declare_parameters(
        self,
        namespace: str,
        parameters: Iterable[Sequence[Any]],
        ignore_override: bool = False,
    ) -> list[Parameter]:
        """Declare parameters, each as (name, value or type, descriptor), and return them."""
        declared: dict[str, tuple[Parameter, Any]] = {}
        for short, *rest in parameters:
            if not isinstance(short, str):
                raise TypeError(f"the name of a parameter is a str, not {short!r}")
            name = f"{namespace}.{short}" if namespace else short
            if not short:
                raise InvalidParameterException(name)
            value, given = [*rest, None, None][:2]
            descriptor = _descriptor(name, given)
            type_ = value if isinstance(value, ParameterType) else None
            if type_ is not None:
                value = None
            elif hasattr(value, "string_array_value"):
                value = parameter_value_to_python(value)
            if not descriptor.dynamic_typing:
                type_ = type_ or ParameterType.from_parameter_value(value)
                if type_ is ParameterType.NOT_SET:
                    raise ValueError(
                        f"`{name}` has neither a value nor a type; pass a value, a type, or a"
                        " descriptor with `dynamic_typing=True`"
                    )
                descriptor.type = type_.value
            if not ignore_override and name in self._parameter_overrides:
                value = self._parameter_overrides[name].value
            kind = type_ if type_ and type_.check(value) else None
            declared[name] = Parameter(name, kind, value), descriptor
        if known := [name for name in declared if name in self._parameters]:
            raise ParameterAlreadyDeclaredException(known)
        for name, (parameter, descriptor) in declared.items():
            result = self._set_parameters([parameter], {name: descriptor})
            if not result.successful:
                wrong_type = result.reason.startswith(_WRONG_TYPE)
                error = (
                    InvalidParameterTypeException if wrong_type else InvalidParameterValueException
                )
                raise error(name, parameter.value, result.reason)
        return [self._parameters[name] for name in declared]

    def undeclare_parameter(self, name: str) -> None:
        """Remove a parameter that is not read-only."""
        if name not in self._parameters:
            raise ParameterNotDeclaredException(name)
        if self._known_descriptor(name).read_only:
            raise ParameterImmutableException(name)
        self._forget_parameter(name)

    def _forget_parameter(self, name: str) -> None:
        self._parameters.pop(name, None)
        self._parameter_descriptors.pop(name, None)

    # values

    def has_parameter(self, name: str) -> bool:
        """Return whether a parameter is declared."""
        return name in self._parameters

    def get_parameter(self, name: str) -> Parameter:
        """Return a parameter."""
        if name in self._parameters:
            parameter = self._parameters[name]
            is_set = parameter.type_ is not ParameterType.NOT_SET
            if is_set or self._known_descriptor(name).dynamic_typing:
                return parameter
            raise ParameterUninitializedException(name)
        if self._allow_undeclared_parameters:
            return Parameter(name)
        raise ParameterNotDeclaredException(name)

    def get_parameters(self, names: Iterable[str]) -> list[Parameter]:
        """Return parameters."""
        return [self.get_parameter(name) for name in names]

    def get_parameter_or(self, name: str, alternative_value: Parameter | None = None) -> Parameter:
        """Return a parameter, or the alternative if it has no value."""
        parameter = self._parameters.get(name)
        if parameter is None or parameter.type_ is ParameterType.NOT_SET:
            return alternative_value or Parameter(name)
        return parameter

    def get_parameters_by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """Return the parameters whose names begin with a prefix and a dot, without these."""
        start = f"{prefix}." if prefix else ""
        return {
            name.removeprefix(start): parameter
            for name, parameter in self._parameters.items()
            if name.startswith(start)
        }

    def get_parameter_type(self, name: str) -> int:
        """Return the type of a parameter, as a number of rcl_interfaces/msg/ParameterType."""
        if name in self._parameters:
            return int(self._parameters[name].type_.value)
        if self._allow_undeclared_parameters:
            return 0
        raise ParameterNotDeclaredException(name)

    def get_parameter_types(self, names: Iterable[str]) -> list[int]:
        """Return the types of parameters."""
        return [self.get_parameter_type(name) for name in names]

    def set_parameters(self, parameter_list: Iterable[Parameter]) -> list[Any]:
        """Set parameters one by one, and return their results."""
        return [self.set_parameters_atomically([parameter]) for parameter in parameter_list]

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> Any:
        """Set all parameters or none, and return the result; NOT_SET undeclares a parameter."""
        if self._pre_set_callbacks:
            parameter_list = [
                each for call in self._pre_set_callbacks for each in call(parameter_list)
            ]
            if not parameter_list:
                return _result("a pre-set callback removed all parameters")
        if not all(isinstance(parameter, Parameter) for parameter in parameter_list):
            raise TypeError("parameters must be instances of Parameter")
        unknown = [each.name for each in parameter_list if each.name not in self._parameters]
        if unknown and not self._allow_undeclared_parameters:
            raise ParameterNotDeclaredException(unknown)
        return self._set_parameters(parameter_list, None)

    def _set_parameters(self, parameters: list[Parameter], new: dict[str, Any] | None) -> Any:
        """Check and set parameters; declarations have `new` descriptors."""
        for parameter in parameters:
            name = parameter.name
            descriptor = new[name] if new else self._known_descriptor(name)
            if descriptor and (reason := self._parameter_problem(parameter, descriptor, new)):
                return _result(reason)
        for check in self._on_set_callbacks:
            result = check(parameters)
            if not hasattr(result, "successful"):
                return _result("a callback of the node returned no SetParametersResult")
            if not result.successful:
                return result
        event = message_of("ParameterEvent", node=self.get_fully_qualified_name())
        for parameter in parameters:
            name = parameter.name
            if new is None and parameter.type_ is ParameterType.NOT_SET:
                event.deleted_parameters.append(parameter.to_parameter_msg())
                self._forget_parameter(name)
                continue
            if new is not None or name not in self._parameter_descriptors:
                descriptor = (new or {}).get(name) or _descriptor(name, None, dynamic_typing=True)
                self._parameter_descriptors[name] = descriptor
            if self._parameter_descriptors[name].dynamic_typing:
                self._parameter_descriptors[name].type = parameter.type_.value
            is_new = self.get_parameter_or(name).type_ is ParameterType.NOT_SET
            changes = event.new_parameters if is_new else event.changed_parameters
            changes.append(parameter.to_parameter_msg())
            self._parameters[name] = parameter
        event.stamp = self.get_clock().now().to_msg()
        self._parameter_events.publish(event)
        if new is None and (simulated := self._parameters.get(_SIM_TIME)) in parameters:
            self.use_sim_time(simulated.value)
        for call in self._post_set_callbacks:
            call(parameters)
        return _result()

    def _parameter_problem(
        self, parameter: Parameter, descriptor: Any, new: dict[str, Any] | None
    ) -> str:
        """Return the reason why a descriptor forbids a value; empty if it does not."""
        type_, value = parameter.type_, parameter.value
        if new is None and descriptor.read_only:
            return f"`{parameter.name}` is read-only"
        if not descriptor.dynamic_typing:
            if type_ is ParameterType.NOT_SET:
                return "" if new else f"`{parameter.name}` has a fixed type, and stays declared"
            if type_.value != descriptor.type:
                wanted = ParameterType(descriptor.type)
                return f"{_WRONG_TYPE}: `{parameter.name}` is {wanted.name}, not {type_.name}"
        ranges = {
            ParameterType.INTEGER: descriptor.integer_range,
            ParameterType.DOUBLE: descriptor.floating_point_range,
        }.get(type_, ())
        for each in ranges:
            low, high = sorted((each.from_value, each.to_value))
            if any(_is_close(value, end) for end in (low, high)):
                continue
            if not low < value < high:
                return f"`{parameter.name}` must be from {low} to {high}, not {value}"
            if each.step and not _is_close(
                low + round((value - low) / each.step) * each.step, value
            ):
                return f"`{parameter.name}` must be from {low} in steps of {each.step}, not {value}"
        return ""

    # callbacks

    def add_pre_set_parameters_callback(self, callback: Callback) -> None:
        """Call `callback` with parameters to be set; it returns those that shall be set instead."""
        self._pre_set_callbacks.insert(0, callback)

    def add_on_set_parameters_callback(self, callback: Callback) -> None:
        """Call `callback` with parameters to be set; it returns a SetParametersResult."""
        self._on_set_callbacks.insert(0, callback)

    def add_post_set_parameters_callback(self, callback: Callback) -> None:
        """Call `callback` with the parameters that were set."""
        self._post_set_callbacks.insert(0, callback)

    def remove_pre_set_parameters_callback(self, callback: Callback) -> None:
        """Remove a callback; raise ValueError if it was not added."""
        self._pre_set_callbacks.remove(callback)

    def remove_on_set_parameters_callback(self, callback: Callback) -> None:
        """Remove a callback; raise ValueError if it was not added."""
        self._on_set_callbacks.remove(callback)

    def remove_post_set_parameters_callback(self, callback: Callback) -> None:
        """Remove a callback; raise ValueError if it was not added."""
        self._post_set_callbacks.remove(callback)

    # descriptions

    def describe_parameter(self, name: str) -> Any:
        """Return the descriptor of a parameter."""
        if descriptor := self._known_descriptor(name):
            return descriptor
        if self._allow_undeclared_parameters:
            return message_of("ParameterDescriptor", name=name)
        raise ParameterNotDeclaredException(name)

    def _known_descriptor(self, name: str) -> Any:
        """Return the descriptor of a parameter, `None` if it is not declared."""
        if (
            name == _SIM_TIME
            and name in self._parameters
            and name not in self._parameter_descriptors
        ):
            self._parameter_descriptors[name] = _descriptor(
                name, None, type=ParameterType.BOOL.value
            )
        return self._parameter_descriptors.get(name)

    def describe_parameters(self, names: Iterable[str]) -> list[Any]:
        """Return the descriptors of parameters."""
        return [self.describe_parameter(name) for name in names]

    def list_parameters(self, prefixes: Iterable[str], depth: int) -> Any:
        """Return a ListParametersResult of the names with any of the prefixes, or of all.

        A name has at most `depth` parts more than its prefix, or any number if `depth` is 0.
        """
        chosen = {*prefixes}
        if depth < 0:
            raise ValueError("the depth must be at least 0")
        result = message_of("ListParametersResult")
        above: dict[str, None] = {}
        for name in self._parameters:
            parts = name.split(".")
            starts = range(1, len(parts)) if chosen else (0,)
            if name in chosen or any(
                (depth == 0 or len(parts) - at <= depth)
                and (not at or ".".join(parts[:at]) in chosen)
                for at in starts
            ):
                result.names.append(name)
                if len(parts) > 1:
                    above[".".join(parts[:-1])] = None
        result.prefixes = [*above]
        return result


def _is_close(first: float, second: float) -> bool:
    if isinstance(first, int) and isinstance(second, int):
        return first == second
    return math.isclose(first, second, rel_tol=TOLERANCE)


def _descriptor(name: str, given: Any, **values: Any) -> Any:
    """Return an own descriptor with the values of one that a program may use for several."""
    kind = standard("rcl_interfaces/msg/ParameterDescriptor").kind
    if given is not None:
        if not hasattr(given, "read_only"):
            raise TypeError(f"`{name}` has a ParameterDescriptor, not {given!r}")
        values = {each: getattr(given, each) for each in kind.get_fields_and_field_types()}
    return kind(**{**values, "name": name})


def _result(reason: str = "") -> Any:
    return message_of("SetParametersResult", successful=not reason, reason=reason)
