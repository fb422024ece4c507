"""The roles that a node can have: options, help and generated code keep their order.

`node/ROLE.py.jinja` is what a role adds to a node and to its test.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple, TypeAlias

from idlc.model import ir


class Qos(NamedTuple):
    """A preset: its name on the command line, and its expression in a module.

    `imports` come from rclpy.qos; `constant` is the line that defines `source`, if none does.
    """

    name: str
    source: str
    imports: tuple[str, ...] = ()
    constant: str = ""


DEFAULT_QOS = Qos("default", "10")
SENSOR_DATA = Qos("sensor_data", "qos_profile_sensor_data", ("qos_profile_sensor_data",))
LATCHED = Qos(
    "latched",
    "LATCHED",
    ("DurabilityPolicy", "QoSProfile"),
    "LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)",
)
QOS_PRESETS = (DEFAULT_QOS, SENSOR_DATA, LATCHED)
QOS_NAMES = tuple(preset.name for preset in QOS_PRESETS)


def qos_preset(name: str) -> Qos:
    """Return the preset of a name; raise ValueError if there is none."""
    if name not in QOS_NAMES:
        raise ValueError(f"--qos is one of {', '.join(QOS_NAMES)}, not {name!r}")
    return QOS_PRESETS[QOS_NAMES.index(name)]


#: The imports of a module: the names from each other module.
Imports = Mapping[str, tuple[str, ...]]
NO_IMPORTS: Imports = MappingProxyType({})


class Question(NamedTuple):
    """A question of the wizard besides type and name; the answer is appended to the value."""

    text: str
    default: str
    separator: str = ""


class NodeRequest(NamedTuple):
    """A request that a node sends, with values from its command line.

    `method` is the name of the coroutine that sends it, `cancel` of one that cancels it, both with
    `{}` for the word of the endpoint.
    """

    title: str
    method: str
    cancel: str = ""


#: The value of an option, taken apart: type, topic, and period in seconds.
EndpointValue: TypeAlias = tuple[str, str, float | None]

_TOPIC = re.compile(r"(~?/)?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")


def _typed(text: str, shape: str = "TYPE:NAME") -> EndpointValue:
    """Return the interface and the name that `TYPE:NAME` means."""
    type_, colon, topic = text.partition(":")
    if not colon or not type_ or not topic:
        raise ValueError(f"`{text}` is not {shape}, such as `std_msgs/String:chatter`")
    return type_, endpoint_name(topic), None


def endpoint_name(text: str) -> str:
    """Return the name of a topic, service or action if it can be one."""
    if not _TOPIC.fullmatch(text) or "__" in text:
        raise ValueError(
            f"`{text}` cannot be the name of a topic, service or action: use letters, digits "
            "and single underscores, parts separated by `/`"
        )
    return text


class Role(NamedTuple):
    """A role: its option, its question in the wizard, and what its template needs around it.

    `name` is that of the template and, with dashes, of the option. `kind` is the kind of interface
    that it speaks, if any, of which the template spells out the sections `samples`. Endpoints of
    roles of one `family` have different words, because their names in Python are made in the same
    way. `helpers` are the methods of the node that its own methods call: `pause`, `until`,
    `retire`. `short` and `short_test` are the imports of a short node and its test; a role without
    them has only a robust form.
    """

    name: str
    kind: ir.Kind | None
    help: str
    answer: str
    summary: str
    family: str
    metavar: str = "TYPE:NAME"
    read: Callable[[str], EndpointValue] = _typed
    samples: tuple[str, ...] = ()
    question: Question | None = None
    imports: Imports = NO_IMPORTS
    test_imports: Imports = NO_IMPORTS
    helpers: frozenset[str] = frozenset()
    request: NodeRequest | None = None
    short: Imports | None = None
    short_test: Imports = NO_IMPORTS

    @property
    def option(self) -> str:
        """The option of the command line."""
        return f"--{self.name.replace('_', '-')}"


class EndpointSpec(NamedTuple):
    """One thing that a node does, in a role. `type` is empty in roles without an interface."""

    role: Role
    type: str
    topic: str
    period: float | None = None
    qos: Qos = DEFAULT_QOS

    @property
    def word(self) -> str:
        """The topic as part of a Python name."""
        return re.sub(r"[^a-z0-9]+", "_", self.topic.lower()).strip("_")[:30].rstrip("_")


def _published(text: str) -> EndpointValue:
    """Return what `TYPE:TOPIC[@HZ]` means."""
    type_, colon, rest = text.partition(":")
    topic, at, hertz = rest.partition("@")
    type_, topic, _ = _typed(f"{type_}{colon}{topic}", "TYPE:TOPIC[@HZ]")
    return type_, topic, 1.0 / _positive(hertz, f"the rate of `{topic}`", "Hz") if at else 1.0


def _positive(text: str, subject: str, unit: str) -> float:
    """Return the number in a text, within reasonable limits."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 1e-6 <= value <= 1e6:
        raise ValueError(f"{subject} must be a number of {unit} above 0, not `{text}`")
    return value


_SERVER = ("ActionServer", "CancelResponse", "ServerGoalHandle")
ROLES: tuple[Role, ...] = (
    Role(
        name="publisher",
        short=NO_IMPORTS,
        kind="msg",
        metavar="TYPE:TOPIC[@HZ]",
        help="Publish messages, by default once per second.",
        read=_published,
        answer="publish",
        question=Question("Rate in Hz", "1", separator="@"),
        summary="Publishes to {}",
        family="timer",
        samples=("message",),
    ),
    Role(
        name="subscriber",
        short=NO_IMPORTS,
        kind="msg",
        metavar="TYPE:TOPIC",
        help="Receive messages.",
        answer="subscribe",
        summary="Listens to {}",
        family="subscriber",
    ),
    Role(
        name="service",
        short=NO_IMPORTS,
        kind="srv",
        help="Answer requests.",
        answer="serve",
        summary="Serves {}",
        family="service",
        samples=("response",),
    ),
    Role(
        name="client",
        short=NO_IMPORTS,
        kind="srv",
        help="Call a service.",
        answer="call",
        summary="Calls {}",
        family="action",
        helpers=frozenset({"pause", "until"}),
        request=NodeRequest("the request", "call_{}"),
    ),
    Role(
        name="action_server",
        short={"rclpy.action.server": _SERVER, "rclpy.task": ("Future",)},
        short_test={
            "action_msgs.msg": ("GoalStatus",),
            "rclpy.action.client": ("ActionClient",),
        },
        kind="action",
        help="Execute goals. Clients can cancel them and, with --robust, replace them.",
        answer="act",
        summary="Executes {} goals",
        family="action",
        samples=("result", "feedback"),
        imports={"rclpy.action.server": (*_SERVER, "GoalResponse")},
        test_imports={"action_msgs.msg": ("GoalStatus",), "rclpy.action.client": ("ActionClient",)},
        helpers=frozenset({"pause", "retire"}),
    ),
    Role(
        name="action_client",
        short={"rclpy.action.client": ("ActionClient",), "typing": ("Any",)},
        short_test={"rclpy.action.server": ("ActionServer", "ServerGoalHandle")},
        kind="action",
        help="Send a goal.",
        answer="send goals",
        summary="Sends {} goals",
        family="action",
        imports={
            "action_msgs.msg": ("GoalStatus",),
            "rclpy.action.client": ("ActionClient", "ClientGoalHandle"),
            "rclpy.task": ("Future",),
            "typing": ("Any",),
        },
        test_imports={"rclpy.action.server": _SERVER, "rclpy.task": ("Future",)},
        helpers=frozenset({"pause", "retire", "until"}),
        request=NodeRequest("the goal", "send_{}_goal", cancel="cancel_{}_goal"),
    ),
    Role(
        name="timer",
        short=NO_IMPORTS,
        kind=None,
        metavar="SECONDS",
        help="Call a method periodically.",
        read=lambda text: ("", "tick", _positive(text, "the period of a timer", "seconds")),
        answer="timer",
        question=Question("Period in seconds", "1.0"),
        summary="",
        family="timer",
    ),
)
