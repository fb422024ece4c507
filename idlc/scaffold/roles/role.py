"""The description of a role: a kind of endpoint of nodes, from its option to its test.

Each role has a module beside this one, with all knowledge of it, and two templates,
`node/ROLE.py.jinja` and `node_test/ROLE.py.jinja`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple, TypedDict

import msgspec

from idlc.model import ir
from idlc.scaffold import layout
from idlc.scaffold.layout import call
from idlc.scaffold.samples import Page


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
    for preset in QOS_PRESETS:
        if preset.name == name:
            return preset
    raise ValueError(f"--qos is one of {', '.join(QOS_NAMES)}, not {name!r}")


#: The imports of a module: the names from each other module.
Imports = Mapping[str, tuple[str, ...]]
NO_IMPORTS: Imports = MappingProxyType({})

#: The steps of a lifecycle that a node takes and undoes.
CONFIGURE, ACTIVATE = "configure", "activate"
#: Longer topics are replaced by their word in text.
LONGEST_TITLE = 40
#: Seconds that a test waits for a first message, besides what the node waits itself.
PATIENCE = 20.0


class Question(NamedTuple):
    """A question of the wizard besides type and name; the answer is appended to the value."""

    text: str
    default: str
    separator: str = ""


class Request(NamedTuple):
    """A request that a node sends, with values from its command line.

    `method` begins the name of the coroutine that sends it, `cancel` of one that cancels it.
    """

    method: str
    title: str
    cancel: str = ""


class Value(NamedTuple):
    """The value of an option, taken apart; `period` is in seconds."""

    type: str
    topic: str
    period: float | None = None


class Role(NamedTuple):
    """A role, and how it shows on the command line, in the wizard, in nodes and in their tests.

    `name` is that of the role's templates and, with dashes, of its option. `kind` is the kind of
    interface that it speaks, if any. Endpoints of roles of one `family` have different words,
    because the names of their attributes are made in the same way. `helpers` are the methods of
    the node that its own methods call: `pause`, `until`, `retire`.
    """

    name: str
    kind: ir.Kind | None
    metavar: str
    help: str
    read: Callable[[str], Value]
    answer: str
    summary: str
    node: Callable[[Context], Part]
    test: Callable[[TestContext], TestPart]
    family: str
    question: Question | None = None
    imports: Imports = NO_IMPORTS
    test_imports: Imports = NO_IMPORTS
    helpers: frozenset[str] = frozenset()
    request: Request | None = None

    @property
    def option(self) -> str:
        """The option of the command line."""
        return f"--{self.name.replace('_', '-')}"


class Endpoint(NamedTuple):
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


class Part(msgspec.Struct, frozen=True, kw_only=True):
    """The part of an endpoint in the class of a node. Each role adds attributes of its own.

    `remember`, `create` and `work` are lines of `__init__`. In a lifecycle node the second are run
    when it is configured and the third when it is activated.
    """

    template: str
    word: str
    topic: str
    type: str
    remember: tuple[str, ...] = ()
    create: tuple[str, ...] = ()
    work: tuple[str, ...] = ()


class TestPart(msgspec.Struct, frozen=True, kw_only=True):
    """The test of an endpoint. Each role adds attributes of its own.

    `create` makes the other side of the endpoint, `constants` are lines of the module. `imports`
    are those that not every test of the role needs.
    """

    template: str
    word: str
    type: str
    function: str
    create: str = ""
    constants: tuple[str, ...] = ()
    imports: Imports = NO_IMPORTS


class PartNames(TypedDict):
    """The first attributes of all parts of nodes."""

    template: str
    word: str
    topic: str
    type: str


class TestNames(TypedDict):
    """The first attributes of all parts of tests."""

    template: str
    word: str
    type: str
    function: str


class Context(NamedTuple):
    """An endpoint of a node whose module is being written.

    `type` is the name of the interface's class in the module; `sections` are its messages.
    """

    endpoint: Endpoint
    word: str
    type: str
    sections: tuple[ir.Message, ...]
    page: Page
    lifecycle: bool

    @property
    def names(self) -> PartNames:
        """The attributes that parts of all roles have."""
        template = f"node/{self.endpoint.role.name}.py.jinja"
        title = _title(self.endpoint, self.word)
        return PartNames(template=template, word=self.word, topic=title, type=self.type)

    def log(self, variable: str, message: ir.Message) -> tuple[str, ...]:
        """Return the lines that log a message, its short fields one by one."""
        return layout.log_lines(_title(self.endpoint, self.word), variable, message)

    def undo(self, step: str, *words: str) -> tuple[str, ...]:
        """Return the lines by which a lifecycle node remembers how to undo the line before."""
        return undo(step, *words) if self.lifecycle else ()


class TestContext(NamedTuple):
    """An endpoint of a node whose test is being written.

    `topic` is a literal of the name that other nodes use. `ends` is whether the node ends when the
    endpoint has done its work.
    """

    endpoint: Endpoint
    word: str
    type: str
    sections: tuple[ir.Message, ...]
    topic: str
    ends: bool

    def names(self, verb: str) -> TestNames:
        """Return the attributes that the tests of all roles have."""
        return TestNames(
            template=f"node_test/{self.endpoint.role.name}.py.jinja",
            word=self.word,
            type=self.type,
            function=f"test_it_{verb}_{self.word}",
        )

    def logged(self, variable: str, message: ir.Message) -> str:
        """Return a literal of the start of the line that logs a message."""
        return repr(layout.log_head(_title(self.endpoint, self.word), variable, message))

    @property
    def patience(self) -> float:
        """The number of seconds to wait for two messages."""
        return round(PATIENCE + 3 * (self.endpoint.period or 0.0), 1)


def undo(step: str, *words: str) -> tuple[str, ...]:
    """Return the line that remembers a call by which to undo a step of the lifecycle."""
    return tuple(call(f"self.undo_{step}.callback", words, depth=2))


def creation(function: str, words: list[str]) -> str:
    """Return the lines of a test that create something, the first without its indentation."""
    return "\n    ".join(call(function, words, depth=1))


def _title(endpoint: Endpoint, word: str) -> str:
    """Return the name of an endpoint in text."""
    return endpoint.topic if len(endpoint.topic) <= LONGEST_TITLE else word


_TOPIC = re.compile(r"(~?/)?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")


def typed(text: str, shape: str = "TYPE:NAME") -> Value:
    """Return the interface and the name that `TYPE:NAME` means."""
    type_, colon, topic = text.partition(":")
    if not colon or not type_ or not topic:
        raise ValueError(f"`{text}` is not {shape}, such as `std_msgs/String:chatter`")
    if not _TOPIC.fullmatch(topic) or "__" in topic:
        raise ValueError(
            f"`{topic}` cannot be the name of a topic, service or action: use letters, digits "
            "and single underscores, parts separated by `/`"
        )
    return Value(type_, topic)


def positive(text: str, what: str, unit: str) -> float:
    """Return the number in a text, within reasonable limits."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 1e-6 <= value <= 1e6:
        raise ValueError(f"{what} must be a number of {unit} above 0, not `{text}`")
    return value


def interval(seconds: float) -> str:
    """Return a period in seconds as source."""
    text = repr(round(seconds, 6))
    return text if abs(float(text) - seconds) < seconds * 1e-9 else f"1.0 / {1.0 / seconds:.6g}"
