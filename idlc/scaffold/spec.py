"""What a node is to do, read from the words on the command line.

Raises ValueError with a message for people where a word cannot be understood.
"""

from __future__ import annotations

import keyword
import re
import sys
from collections.abc import Iterable
from typing import Literal, NamedTuple, TypeAlias

from idlc.model import ir

Role: TypeAlias = Literal[
    "publisher", "subscriber", "service", "client", "action_server", "action_client"
]
#: Each role with the kind of interface that it speaks.
ROLES: dict[Role, ir.Kind] = {
    "publisher": "msg",
    "subscriber": "msg",
    "service": "srv",
    "client": "srv",
    "action_server": "action",
    "action_client": "action",
}
QOS = ("default", "sensor_data", "latched")
#: What separates a quality of service from the endpoint that it belongs to.
QOS_MARK = "\0qos="

#: Names that a module of a node cannot have in its package.
TAKEN = frozenset({"msg", "srv", "action"})
_TOPIC = re.compile(r"(~?/)?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")
_NODE = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
_PARAMETER = re.compile(r"[A-Za-z][A-Za-z0-9_]*(\.[A-Za-z][A-Za-z0-9_]*)*")

Scalar: TypeAlias = bool | int | float | str
#: The types of parameters by the names that people know them by.
PARAMETERS: dict[str, type[Scalar]] = {
    "bool": bool,
    "int": int,
    "integer": int,
    "float": float,
    "double": float,
    "str": str,
    "string": str,
}
_BOOLEANS = {"true": True, "false": False}


class Endpoint(NamedTuple):
    """One thing that a node offers or uses; `rate` is in Hz, for publishers only."""

    role: Role
    type: str
    topic: str
    rate: float | None = None
    qos: str = "default"

    @property
    def word(self) -> str:
        """The topic as part of a Python name."""
        return re.sub(r"[^a-z0-9]+", "_", self.topic.lower()).strip("_")[:30].rstrip("_")


class Parameter(NamedTuple):
    """A parameter with its default."""

    name: str
    default: Scalar | tuple[Scalar, ...]
    annotation: str

    @property
    def word(self) -> str:
        """The name as part of a Python name."""
        return self.name.lower().replace(".", "_")


class Node(NamedTuple):
    """A node as asked for; `timers` are periods in seconds."""

    name: str
    package: str
    endpoints: tuple[Endpoint, ...] = ()
    timers: tuple[float, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    lifecycle: bool = False


def check_name(name: str) -> str:
    """Return a node's name if it can be the name of a module and of a command."""
    if not _NODE.fullmatch(name):
        raise ValueError(
            f"`{name}` cannot be a node: use lower-case letters, digits and single underscores, "
            "a letter first"
        )
    if keyword.iskeyword(name) or name in TAKEN or name in sys.stdlib_module_names:
        raise ValueError(
            f"`{name}` cannot be a node: the name is taken by a module of Python or by interfaces"
        )
    return name


def endpoint(role: Role, text: str) -> Endpoint:
    """Return the endpoint that `TYPE:TOPIC[@HZ]` means."""
    text, _, qos = text.partition(QOS_MARK)
    type_, colon, topic = text.partition(":")
    rate = None
    if role == "publisher" and "@" in topic:
        topic, _, hertz = topic.partition("@")
        rate = _positive(hertz, f"the rate of `{topic}`", "Hz")
    shape = "TYPE:TOPIC[@HZ]" if role == "publisher" else "TYPE:NAME"
    if not colon or not type_ or not topic:
        raise ValueError(f"`{text}` is not {shape}, such as `std_msgs/String:chatter`")
    if not _TOPIC.fullmatch(topic) or "__" in topic:
        raise ValueError(
            f"`{topic}` cannot be the name of a topic, service or action: use letters, digits "
            "and single underscores, parts separated by `/`"
        )
    if qos and ROLES[role] != "msg":
        raise ValueError("--qos is for publishers and subscribers")
    return Endpoint(role, type_, topic, rate, qos or "default")


def period(text: str) -> float:
    """Return a timer's period in seconds."""
    return _positive(text, "the period of a timer", "seconds")


def _positive(text: str, what: str, unit: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 1e-6 <= value <= 1e6:
        raise ValueError(f"{what} must be a number of {unit} above 0, not `{text}`")
    return value


def parameter(text: str) -> Parameter:
    """Return the parameter that `NAME:TYPE=DEFAULT` means; `TYPE[]` for several values."""
    head, equals, default = text.partition("=")
    name, _, type_ = head.partition(":")
    element = PARAMETERS.get(type_.removesuffix("[]"))
    if not equals or element is None or not _PARAMETER.fullmatch(name):
        raise ValueError(
            f"`{text}` is not NAME:TYPE=DEFAULT, such as `speed:double=0.5`; types are "
            + ", ".join(PARAMETERS)
            + ", and each with []"
        )
    if not type_.endswith("[]"):
        return Parameter(name, _value(element, default, name), element.__name__)
    parts = [part.strip() for part in default.split(",") if part.strip()]
    values = tuple(_value(element, part, name) for part in parts)
    if not values:
        raise ValueError(f"the parameter `{name}` needs at least one value, such as `=1,2`")
    return Parameter(name, values, f"list[{element.__name__}]")


def _value(type_: type[Scalar], text: str, name: str) -> Scalar:
    try:
        if type_ is bool:
            return _BOOLEANS[text.lower()]
        value = type_(text)
    except (ValueError, KeyError):
        raise ValueError(f"`{text}` is no {type_.__name__}, for the parameter `{name}`") from None
    if isinstance(value, float) and value - value != 0:
        raise ValueError(f"`{text}` is not finite, for the parameter `{name}`")
    if isinstance(value, int) and not -(1 << 63) <= value < 1 << 63:
        raise ValueError(f"`{text}` does not fit into 64 bits, for the parameter `{name}`")
    return value


#: Roles whose endpoints share the names of attributes and methods.
_FAMILIES = {"action_server": "action", "action_client": "action", "client": "action"}


def words(endpoints: Iterable[Endpoint]) -> list[str]:
    """Return a word for each endpoint, no two the same where names are made of them."""
    seen: set[tuple[str, str]] = set()
    found = []
    for one in endpoints:
        family, word, count = _FAMILIES.get(one.role, one.role), one.word, 1
        while (family, word) in seen:
            count += 1
            word = f"{one.word}_{count}"
        seen.add((family, word))
        found.append(word)
    return found


def class_name(name: str) -> str:
    """Return the class of a node: `command_publisher` is a CommandPublisher."""
    return "".join(part.capitalize() for part in name.split("_"))
