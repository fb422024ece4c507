"""The test of a node: one test for each of its endpoints, on the real rclpy."""

from __future__ import annotations

from typing import NamedTuple

from idlc.emit.render import environment
from idlc.scaffold.endpoints import DEFAULT_RATE, QOS, QOS_IMPORTS
from idlc.scaffold.layout import call, imports
from idlc.scaffold.plan import Plan
from idlc.scaffold.samples import Page
from idlc.scaffold.spec import Endpoint

#: Seconds to wait for a first message, beyond what a publisher waits itself.
PATIENCE = 20.0
_TAKEN = (
    *("ActionClient", "ActionServer", "Any", "Callable", "ChangeState", "GoalStatus", "Node"),
    *("ServerGoalHandle", "Start", "Transition", "Until", "DurabilityPolicy", "QoSProfile"),
)


class PartView(NamedTuple):
    """The test of one endpoint; lines are finished, without their indentation."""

    template: str
    function: str
    topic: str
    type: str
    create: str
    started: str = ""
    goal: str = ""
    ends: bool = False
    patience: float = PATIENCE


class TestView(NamedTuple):
    """What the template of a test shows."""

    node: str
    module: str
    imports: tuple[tuple[str, ...], ...]
    parts: tuple[PartView, ...]
    lifecycle: bool
    once: bool
    stays: bool


def render(planned: Plan) -> str:
    """Return the text of a node's test."""
    template = environment().get_template("scaffold_test_node.py.jinja")
    return template.render(test=view(planned))


def view(planned: Plan) -> TestView:
    """Return the lines of a node's test."""
    node = planned.node
    page = Page(planned.messages, taken=_TAKEN)
    parts = []
    for endpoint, word, interface in zip(
        node.endpoints, planned.words, planned.interfaces, strict=True
    ):
        parts.append(_part(planned, endpoint, word, page.use(interface.name)))
    return TestView(
        node=node.name,
        module=f"{node.package}.{node.name}",
        imports=_imports(planned, page),
        parts=tuple(parts),
        lifecycle=node.lifecycle,
        once=planned.once,
        stays=not planned.once,
    )


_VERBS = {
    "publisher": "publishes",
    "subscriber": "receives",
    "service": "answers",
    "client": "calls",
    "action_server": "reaches",
    "action_client": "sends",
}


def _part(planned: Plan, endpoint: Endpoint, word: str, type_: str) -> PartView:
    topic = repr(endpoint.topic.replace("~", planned.node.name))
    qos = QOS[endpoint.qos]
    if endpoint.qos == "latched":
        qos = "QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)"
    create = {
        "publisher": ("observer.create_subscription", [type_, topic, "received.append", qos]),
        "subscriber": ("publisher = observer.create_publisher", [type_, topic, qos]),
        "service": ("client = observer.create_client", [type_, topic]),
        "client": ("observer.create_service", [type_, topic, "answer"]),
        "action_server": ("client = ActionClient", ["observer", type_, topic]),
        "action_client": ("server = ActionServer", ["observer", type_, topic, "execute"]),
    }[endpoint.role]
    ends = planned.once and len(planned.clients) == 1
    lines = call(*create, depth=1)
    rate = endpoint.rate or DEFAULT_RATE
    return PartView(
        template=f"test_{endpoint.role}.py.jinja",
        function=f"test_it_{_VERBS[endpoint.role]}_{word}",
        topic=word,
        type=type_,
        create="\n    ".join(lines),
        started="node = start(MODULE)" if ends else "start(MODULE)",
        goal=f"{type_}.Goal()",
        ends=ends,
        patience=round(PATIENCE + 2 / rate, 1),
    )


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
        add("rclpy.action.server", "ActionServer", "ServerGoalHandle")
    if node.lifecycle:
        add("lifecycle_msgs.msg", "Transition")
        add("lifecycle_msgs.srv", "ChangeState")
    if node.endpoints or not planned.once:
        add("rclpy.node", "Node")
    standard = imports(
        {"collections.abc": ["Callable"], "typing": ["Any"]}, () if planned.once else ("signal",)
    )
    return tuple(standard), tuple(imports(names, () if planned.once else ("pytest",)))
