"""Values of parameters from the command line: `-p name:=value`, and YAML files of ROS 2.

Values have the types that ROS 2 gives them, which is neither YAML 1.1 nor 1.2: `1:30` and `null`
are strings, `y` is true, `010` is 8, `1e3` is a double.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from enum import IntEnum
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from idlc.diagnostics.text import one_line
from idlc.robot.errors import RobotError
from idlc.robot.nodes.arguments import Arguments
from idlc.robot.nodes.interfaces import standard
from idlc.robot.parameters import Parameter, ParameterAlreadyDeclaredException
from idlc.robot.qos import QoSPolicyKind, QoSProfile, qos_profile

_MARK = "ros__parameters"
_ANY = "/**"
_PLAIN = "!plain"
_STRING = "tag:yaml.org,2002:str"
_TRUE = {"y", "Y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"}
_FALSE = {"n", "N", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"}
#: Hexadecimal, octal and decimal numbers.
_INTEGER = re.compile(r"[-+]?(?:(0[xX][0-9a-fA-F]+)|(0[0-7]*)|([1-9][0-9]*))")
_DOUBLE = re.compile(r"(?ai)[-+]?((\d+\.?\d*|\.\d+)(e[-+]?\d+)?|\.?inf(inity)?|\.?nan)")


class _Loader(yaml.SafeLoader):  # type: ignore[misc] # PyYAML is not typed
    """A loader that does not guess the type of what stands without quotes."""

    yaml_implicit_resolvers = {"": [("nothing", re.compile(""))], None: [(_PLAIN, re.compile(""))]}  # noqa: RUF012 - PyYAML's

    def compose_node(self, *above: object) -> yaml.Node:
        """Return the next node."""
        if self.check_event(yaml.AliasEvent):
            place = self.peek_event().start_mark
            raise yaml.MarkedYAMLError(None, None, "ROS 2 refuses aliases", place)
        return super().compose_node(*above)


def overrides_of(arguments: Arguments, node: str) -> dict[str, Parameter]:
    """Return the parameters that the command line sets for a node; `-p` replaces files.

    `node` is the absolute name of the node. In files, later entries replace earlier ones. `*` in
    the name of a node means any name, `**` any names. Raises RobotError.
    """
    parameters: dict[str, Parameter] = {}
    fits = partial(_matches, node)
    for path in arguments.parameter_files:
        parameters.update(_read(fits, path))
    for only, name, text in arguments.overrides:
        parameters.update(_read(fits, f"-p {name}:={text}", text, only or _ANY, _MARK, name))
    return parameters


def _read(
    fits: Callable[[str], bool], source: str, text: str | None = None, *names: str
) -> dict[str, Parameter]:
    """Return the parameters for nodes in a file, or in a text that belongs below names."""
    parameters: dict[str, Parameter] = {}
    mark = None
    try:
        text = Path(source).read_text(encoding="utf-8") if text is None else text
        tree = yaml.compose(text, _Loader) or yaml.ScalarNode("nothing", "")
        for path, value in [(names, tree)] if names else _entries(tree):
            mark = value.start_mark
            if _MARK not in path[:-1]:
                raise ValueError(f"expected `node:`, `{_MARK}:` and `name: value`")
            end = path.index(_MARK)
            parameter = Parameter(".".join(path[end + 1 :]), value=_value(value))
            if fits("/".join(path[:end])):
                parameters[parameter.name] = parameter
    except (OSError, yaml.YAMLError, RecursionError, TypeError, ValueError) as error:
        mark = getattr(error, "problem_mark", None) or mark
        place = f":{mark.line + 1}:{mark.column + 1}" if mark else ""
        problem = getattr(error, "problem", None) or getattr(error, "strerror", None) or str(error)
        raise RobotError(f"{one_line(source)}{place}: {one_line(problem)}") from None
    return parameters


def _entries(node: yaml.Node, *names: str) -> Iterator[tuple[tuple[str, ...], yaml.Node]]:
    """Yield the values in a node, each with the names around it."""
    if not isinstance(node, yaml.MappingNode):
        yield names, node
        return
    for key, value in node.value:
        if not isinstance(key, yaml.ScalarNode) or not key.value:
            raise yaml.MarkedYAMLError(None, None, "a name is missing", key.start_mark)
        yield from _entries(value, *names, key.value)


def _matches(node: str, pattern: str) -> bool:
    name = node.strip("/").split("/")
    reached = {0}
    for part in filter(None, pattern.split("/")):
        if part == "**":
            reached = {*range(min(reached, default=len(name) + 1), len(name) + 1)}
        else:
            reached = {at + 1 for at in reached if at < len(name) and part in ("*", name[at])}
    return len(name) in reached


def _value(node: yaml.Node) -> object:
    if isinstance(node, yaml.SequenceNode):
        return [_value(item) for item in node.value]
    if node.tag not in (_PLAIN, _STRING):
        raise ValueError(f"expected a value or a list of values, not {node.tag}")
    text: str = node.value
    if node.tag == _STRING:
        return text
    if text in _TRUE or text in _FALSE:
        return text in _TRUE
    if (match := _INTEGER.fullmatch(text)) and len(text) < 64:
        base = 10
        if match[1]:
            base = 16
        elif match[2]:
            base = 8
        number = int(text, base)
        return number if -(2**63) <= number < 2**63 else float(number)
    if _DOUBLE.fullmatch(text):
        return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
    return text


def parameter_dict_from_yaml_file(
    parameter_file: str,
    use_wildcard: bool = False,
    target_nodes: Sequence[str] = (),
    namespace: str = "",
) -> dict[str, Any]:
    """Return the parameters in a file as messages by their names, of all nodes or some.

    `use_wildcard` adds those for `/**`. Raises RobotError.
    """
    found = _read(lambda node: use_wildcard and node == _ANY, parameter_file)
    found |= _read(lambda node: node != _ANY and node in (target_nodes or (node,)), parameter_file)
    messages = [parameter.to_parameter_msg() for parameter in found.values()]
    for message in messages:
        message.name = f"{namespace}.{message.name}" if namespace else message.name
    return {message.name: message for message in messages}


class InvalidQosOverridesError(Exception):
    """A callback refused a profile, or an override is not a value of its policy."""


class QoSOverridingOptions(NamedTuple):
    """The policies that parameters override; `callback` checks the profile that they make.

    `entity_id` tells apart endpoints of one topic.
    """

    policy_kinds: Iterable[QoSPolicyKind]
    callback: Callable[[QoSProfile], Any] | None = None
    entity_id: str | None = None

    @classmethod
    def with_default_policies(
        cls, *, callback: Callable[[QoSProfile], Any] | None = None, entity_id: str | None = None
    ) -> QoSOverridingOptions:
        """Return options for history, depth and reliability."""
        kinds = (QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY)
        return cls(kinds, callback, entity_id)


def QosCallbackResult(**values: Any) -> Any:  # noqa: N802 - rclpy's name of a class
    """Return rcl_interfaces/msg/SetParametersResult."""
    return standard("rcl_interfaces/msg/SetParametersResult").kind(**values)


def overridden(
    node: Any, kind: str, topic: str, qos: QoSProfile | int, options: QoSOverridingOptions | None
) -> QoSProfile:
    """Declare read-only parameters for an endpoint, and return the profile that they make.

    `kind` is `publisher` or `subscription`. Raises InvalidQosOverridesError.
    """
    profile = qos_profile(qos)
    if options is None:
        return profile
    absolute = node.resolve_topic_name(topic)
    place = kind if options.entity_id is None else f"{kind}_{options.entity_id}"
    subject = f"for {kind} `{absolute}` with id `{options.entity_id}`"
    for policy in options.policy_kinds:
        field = policy.name.lower()
        if kind == "subscription" and policy is QoSPolicyKind.LIFESPAN:
            continue
        name, value = f"qos_overrides.{absolute}.{place}.{field}", getattr(profile, field)
        default = value.name.lower() if isinstance(value, IntEnum) else value
        descriptor = standard("rcl_interfaces/msg/ParameterDescriptor").kind(
            description=f"{field} {subject}", read_only=True
        )
        try:
            chosen = node.declare_parameter(name, default, descriptor).value
        except ParameterAlreadyDeclaredException:
            chosen = node.get_parameter(name).value
        try:
            if isinstance(value, IntEnum):
                chosen = type(value)[chosen.upper()]
            setattr(profile, field, chosen)
        except (KeyError, ValueError) as error:
            raise InvalidQosOverridesError(f"`{name}` cannot be {chosen!r}: {error}") from None
    if options.callback is not None:
        result = options.callback(profile)
        if not result.successful:
            problem = f"Provided QoS overrides {subject}, are not valid: {result.reason}"
            raise InvalidQosOverridesError(problem)
    return profile
