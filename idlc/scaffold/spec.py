"""The plan of a node, read from the words on the command line.

Raises ValueError with a message for people for a word that is invalid.
"""

from __future__ import annotations

import keyword
import re
import sys
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from idlc.model import ir
from idlc.scaffold.roles import DEFAULT_QOS, ROLES, EndpointSpec, Role, qos_preset

#: Names that a module of a node cannot have in its package.
TAKEN = frozenset({"msg", "srv", "action"})
_NODE = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
_PARAMETER = re.compile(r"[A-Za-z][A-Za-z0-9_]*(\.[A-Za-z][A-Za-z0-9_]*)*")

#: The types of parameters by their usual names.
PARAMETERS: dict[str, type[ir.Scalar]] = {
    "bool": bool,
    "int": int,
    "integer": int,
    "float": float,
    "double": float,
    "str": str,
    "string": str,
}
_BOOLEANS = {"true": True, "false": False}


class ParameterSpec(NamedTuple):
    """A parameter with its default."""

    name: str
    default: ir.Scalar | tuple[ir.Scalar, ...]
    annotation: str

    @property
    def word(self) -> str:
        """The name as part of a Python name."""
        return self.name.lower().replace(".", "_")


class NodeSpec(NamedTuple):
    """A requested node; its endpoints are in the order of the roles."""

    name: str
    package: str
    endpoints: tuple[EndpointSpec, ...] = ()
    parameters: tuple[ParameterSpec, ...] = ()
    lifecycle: bool = False
    robust: bool = False


def check_name(name: str) -> str:
    """Return a node's name if it can be the name of a module and of a command."""
    if not _NODE.fullmatch(name):
        raise ValueError(
            f"`{name}` cannot be a node: use lower-case letters, digits and single underscores, "
            "and begin with a letter"
        )
    if keyword.iskeyword(name) or name in TAKEN or name in sys.stdlib_module_names:
        raise ValueError(
            f"`{name}` cannot be a node: a Python module or an interface package has this name"
        )
    return name


def endpoint(role: Role, text: str, preset: str | None = None) -> EndpointSpec:
    """Return the endpoint that an option's value means, with a quality of service by its name."""
    if preset is not None and role.kind != "msg":
        options = ", ".join(other.option for other in ROLES if other.kind == "msg")
        raise ValueError(f"--qos is for {options}")
    quality = DEFAULT_QOS if preset is None else qos_preset(preset)
    return EndpointSpec(role, *role.read(text), quality)


def parameter(text: str) -> ParameterSpec:
    """Return the parameter that `NAME:TYPE=DEFAULT` means; `TYPE[]` for several values."""
    head, equals, default = text.partition("=")
    name, _, type_ = head.partition(":")
    element = PARAMETERS.get(type_.removesuffix("[]"))
    if not equals or element is None or not _PARAMETER.fullmatch(name):
        raise ValueError(
            f"`{text}` is not NAME:TYPE=DEFAULT, such as `speed:double=0.5`; types are "
            + ", ".join(PARAMETERS)
            + ", and arrays of these with []"
        )
    if not type_.endswith("[]"):
        return ParameterSpec(name, _value(element, default, name), element.__name__)
    parts = [part.strip() for part in default.split(",") if part.strip()]
    values = tuple(_value(element, part, name) for part in parts)
    if not values:
        raise ValueError(f"the parameter `{name}` needs at least one value, such as `=1,2`")
    return ParameterSpec(name, values, f"list[{element.__name__}]")


def _value(type_: type[ir.Scalar], text: str, name: str) -> ir.Scalar:
    try:
        if type_ is bool:
            return _BOOLEANS[text.lower()]
        value = type_(text)
    except (ValueError, KeyError):
        what = {"int": "an integer", "str": "a string"}.get(type_.__name__, f"a {type_.__name__}")
        raise ValueError(f"the parameter `{name}` needs {what}, not `{text}`") from None
    if isinstance(value, float) and value - value != 0:
        raise ValueError(f"the parameter `{name}` needs a finite number, not `{text}`")
    if isinstance(value, int) and not -(1 << 63) <= value < 1 << 63:
        raise ValueError(f"the parameter `{name}` needs a 64-bit integer, not `{text}`")
    return value


class ResolvedEndpoint(NamedTuple):
    """An endpoint with its interface, if its role has one, and a word for its names."""

    endpoint: EndpointSpec
    word: str
    interface: ir.Interface | None


class NodePlan(NamedTuple):
    """A node with its endpoints and all messages that those may need."""

    node: NodeSpec
    endpoints: tuple[ResolvedEndpoint, ...]
    messages: Mapping[ir.TypeName, ir.Message]

    @property
    def asking(self) -> tuple[ResolvedEndpoint, ...]:
        """The endpoints that send requests or goals, which the command line describes."""
        return tuple(placed for placed in self.endpoints if placed.endpoint.role.request)

    @property
    def once(self) -> bool:
        """True if the node only sends requests, and then ends."""
        endpoints = self.node.endpoints
        only = all(endpoint.role.request for endpoint in endpoints)
        return bool(endpoints) and only and not self.node.lifecycle

    @property
    def short(self) -> bool:
        """True if the node has the short form, which has at most one request and nothing else."""
        roles = [endpoint.role for endpoint in self.node.endpoints]
        if self.node.robust or self.node.lifecycle or any(role.short is None for role in roles):
            return False
        return not self.asking or len(roles) == 1

    @property
    def packages(self) -> list[str]:
        """The packages that the node's module imports, rclpy among them; its own is not."""
        used = {placed.interface.name.package for placed in self.endpoints if placed.interface}
        roles = [endpoint.role for endpoint in self.node.endpoints]
        imports = [(role.short if self.short else role.imports) or {} for role in roles]
        modules = {module for names in imports for module in names}
        libraries = {module.partition(".")[0] for module in modules} - sys.stdlib_module_names
        return sorted(({"rclpy"} | used | libraries) - {self.node.package})


def plan(
    node: NodeSpec,
    interfaces: Iterable[ir.Interface | None],
    messages: Mapping[ir.TypeName, ir.Message],
) -> NodePlan:
    """Return a node with the interfaces of its endpoints, in their order.

    Endpoints of one family have different words.
    """
    placed: list[ResolvedEndpoint] = []
    seen: set[tuple[str, str]] = set()
    for endpoint, interface in zip(node.endpoints, interfaces, strict=True):
        word, count = endpoint.word, 1
        while (endpoint.role.family, word) in seen:
            count += 1
            word = f"{endpoint.word}_{count}"
        seen.add((endpoint.role.family, word))
        placed.append(ResolvedEndpoint(endpoint, word, interface))
    return NodePlan(node, tuple(placed), messages)
