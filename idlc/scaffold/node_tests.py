"""The test of a node: one for each thing that it does, on the real rclpy."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from idlc.model import derive, ir
from idlc.scaffold.endpoints import DEFAULT_RATE, QOS, QOS_IMPORTS, log_head, shown
from idlc.scaffold.line_breaks import call, collection, imports
from idlc.scaffold.planned import Plan
from idlc.scaffold.samples import Page
from idlc.scaffold.spec import Endpoint, Role
from idlc.templating import environment

#: Seconds to wait for a first message, beyond what a node waits itself.
PATIENCE = 20.0
_TAKEN = (
    *("ActionClient", "ActionServer", "Any", "Callable", "CancelResponse", "ChangeState", "Future"),
    *("GetParameters", "GoalStatus", "Node", "ServerGoalHandle", "Start", "Transition"),
    *("DurabilityPolicy", "MODULE", "OFFERED", "PARAMETERS", "QoSProfile"),
)
_VERBS: dict[Role, str] = {
    "publisher": "publishes",
    "subscriber": "receives",
    "service": "answers",
    "client": "calls",
    "action_server": "reaches",
    "action_client": "sends",
}
#: Which sections of its interface a node logs, and what its module calls them.
_LOGGED: dict[Role, tuple[tuple[str, int], ...]] = {
    "publisher": (),
    "subscriber": (("message", 0),),
    "service": (("request", 0),),
    "client": (("response", 1),),
    "action_server": (("goal", 0),),
    "action_client": (("feedback", 2), ("result", 1)),
}


class PartView(NamedTuple):
    """The test of one endpoint; lines are finished, without their indentation.

    `said` is how a line begins that the node logs, as a literal, and `said_at_last` the last one.
    """

    template: str
    function: str
    topic: str
    type: str
    create: str
    create_cancellable: str
    said: str
    said_at_last: str
    goal: str
    ends: bool
    patience: float


class TimerView(NamedTuple):
    """The test of a timer of the node's own."""

    name: str
    patience: float


class TestView(NamedTuple):
    """What the template of a test shows; `waiting` starts a node that does not end by itself."""

    node: str
    module: str
    imports: tuple[tuple[str, ...], ...]
    constants: tuple[str, ...]
    parts: tuple[PartView, ...]
    timers: tuple[TimerView, ...]
    has_parameters: bool
    lifecycle: bool
    once: bool
    waiting: str
    asked: int


def render(planned: Plan) -> str:
    """Return the text of a node's test."""
    template = environment().get_template("node_test/module.py.jinja")
    return template.render(test=view(planned))


def view(planned: Plan) -> TestView:
    """Return the lines of a node's test."""
    node = planned.node
    page = Page(planned.messages, taken=_TAKEN)
    parts = []
    for endpoint, word, interface in zip(
        node.endpoints, planned.words, planned.interfaces, strict=True
    ):
        parts.append(_part(planned, endpoint, word, interface, page.use(interface.name)))
    return TestView(
        node=node.name,
        module=f"{node.package}.{node.name}",
        imports=_imports(planned, page),
        constants=(*_constants(planned), *(f"{p.goal} = {p.type}.Goal()" for p in parts if p.goal)),
        parts=tuple(parts),
        timers=tuple(
            TimerView("tick" if n == 0 else f"tick_{n + 1}", _patience(seconds))
            for n, seconds in enumerate(node.timers)
        ),
        has_parameters=bool(node.parameters),
        lifecycle=node.lifecycle,
        once=planned.once,
        waiting="MODULE, '--server-timeout', '1000'" if planned.once else "MODULE",
        asked=130 if planned.once else 0,
    )


def _patience(period: float) -> float:
    """Return how long to wait for what comes twice."""
    return round(PATIENCE + 3 * period, 1)


def _part(
    planned: Plan, endpoint: Endpoint, word: str, interface: ir.Interface, type_: str
) -> PartView:
    topic = repr(endpoint.topic.replace("~", planned.node.name))
    qos = QOS[endpoint.qos]
    if endpoint.qos == "latched":
        qos = "QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)"
    server = ["observer", type_, topic, "execute"]
    create = {
        "publisher": ("observer.create_subscription", [type_, topic, "received.append", qos]),
        "subscriber": ("publisher = observer.create_publisher", [type_, topic, qos]),
        "service": ("client = observer.create_client", [type_, topic]),
        "client": ("observer.create_service", [type_, topic, "answer"]),
        "action_server": ("client = ActionClient", ["observer", type_, topic]),
        "action_client": ("server = ActionServer", server),
    }[endpoint.role]
    cancellable = ("server = ActionServer", [*server, "cancel_callback=cancel"])
    sections = derive.sections(interface)
    said = [
        repr(log_head(shown(endpoint, word), variable, sections[at]))
        for variable, at in _LOGGED[endpoint.role]
    ]
    return PartView(
        template=f"node_test/{endpoint.role}.py.jinja",
        function=f"test_it_{_VERBS[endpoint.role]}_{word}",
        topic=word,
        type=type_,
        create="\n    ".join(call(*create, depth=1)),
        create_cancellable="\n    ".join(call(*cancellable, depth=1)),
        said=said[0] if said else "",
        said_at_last=said[-1] if said else "",
        goal=f"{word.upper()}_GOAL" if endpoint.role == "action_server" else "",
        ends=planned.once and len(planned.clients) == 1,
        patience=_patience(1 / (endpoint.rate or DEFAULT_RATE)),
    )


def _constants(planned: Plan) -> Iterator[str]:
    """Yield the lines of what the tests compare with."""
    node = planned.node
    if node.lifecycle:
        names = sorted({repr(_resolved(endpoint, node.name)) for endpoint in node.endpoints})
        yield from (
            collection("OFFERED = ", "{", names, "}") if names else ["OFFERED: set[str] = set()"]
        )
    if node.parameters:
        values = (
            list(p.default) if isinstance(p.default, tuple) else p.default for p in node.parameters
        )
        pairs = [f"{p.name!r}: {v!r}" for p, v in zip(node.parameters, values, strict=True)]
        yield from collection("PARAMETERS = ", "{", pairs, "}")


def _resolved(endpoint: Endpoint, node: str) -> str:
    """Return a name that says in ROS 2's graph that an endpoint is there."""
    topic = endpoint.topic.replace("~", f"/{node}")
    whole = topic if topic.startswith("/") else f"/{topic}"
    return f"{whole}/_action/send_goal" if "action" in endpoint.role else whole


def _imports(planned: Plan, page: Page) -> tuple[tuple[str, ...], ...]:
    node = planned.node
    roles = {endpoint.role for endpoint in node.endpoints}
    names = page.imports()

    def add(module: str, *found: str) -> None:
        if found:
            names.setdefault(module, set()).update(found)

    for endpoint in node.endpoints:
        add("rclpy.qos", *QOS_IMPORTS[endpoint.qos])
    if "action_server" in roles:
        add("action_msgs.msg", "GoalStatus")
        add("rclpy.action.client", "ActionClient")
    if "action_client" in roles:
        ends = planned.once and len(planned.clients) == 1
        add("rclpy.action.server", "ActionServer", "ServerGoalHandle")
        add("rclpy.action.server", *(["CancelResponse"] if ends else []))
        add("rclpy.task", "Future")
    if node.lifecycle:
        add("lifecycle_msgs.msg", "Transition")
        add("lifecycle_msgs.srv", "ChangeState")
    if node.parameters:
        add("rcl_interfaces.srv", "GetParameters")
        add("rclpy.parameter", "parameter_value_to_python")
    add("rclpy.node", "Node")
    standard = imports({"collections.abc": ["Callable"], "typing": ["Any"]}, ("signal",))
    return tuple(standard), tuple(imports(names, ("pytest",)))
