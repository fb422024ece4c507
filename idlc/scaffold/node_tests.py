"""The test of a node: one for each thing that it does, on the real rclpy."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from idlc.model import derive
from idlc.scaffold.layout import ImportList, collection
from idlc.scaffold.node import node_constants
from idlc.scaffold.roles import ROLES, role
from idlc.scaffold.roles.role import Endpoint, TestContext, TestPart
from idlc.scaffold.samples import Page
from idlc.scaffold.spec import Placed, Plan
from idlc.scaffold.templates import Templates

#: Names that a test uses itself.
_TAKEN = (
    *("Any", "Callable", "ChangeState", "Future", "GetParameters", "Node", "Start", "Transition"),
    *("MODULE", "OFFERED", "PARAMETERS", "CancelResponse"),
    *(name for preset in role.QOS_PRESETS for name in (*preset.imports, preset.source)),
    *(name for role in ROLES for names in role.test_imports.values() for name in names),
)


class TestView(NamedTuple):
    """The content of a test's template; `waiting` starts a node that does not end by itself.

    `interrupted` is the status with which it ends when it is asked to.
    """

    node: str
    module: str
    imports: tuple[tuple[str, ...], ...]
    constants: tuple[str, ...]
    parts: tuple[TestPart, ...]
    has_parameters: bool
    lifecycle: bool
    once: bool
    waiting: str
    interrupted: int


def render(planned: Plan, templates: Templates) -> str:
    """Return the text of a node's test."""
    return templates.render("node_test/module.py.jinja", test=view(planned))


def view(planned: Plan) -> TestView:
    """Return the lines of a node's test."""
    node = planned.node
    page = Page(planned.messages, taken=_TAKEN)
    parts = tuple(_part(planned, placed, page) for placed in planned.endpoints)
    of_parts = (line for part in parts for line in part.constants)
    return TestView(
        node=node.name,
        module=f"{node.package}.{node.name}",
        imports=_collected(planned, parts, page).groups(("pytest", "signal")),
        constants=(*filter(None, node_constants(node)), *_constants(planned), *of_parts),
        parts=parts,
        has_parameters=bool(node.parameters),
        lifecycle=node.lifecycle,
        once=planned.once,
        waiting="MODULE, '--server-timeout', '1000'" if planned.once else "MODULE",
        interrupted=130 if planned.once else 0,
    )


def _part(planned: Plan, placed: Placed, page: Page) -> TestPart:
    endpoint, word, interface = placed
    context = TestContext(
        endpoint,
        word,
        page.use(interface.name) if interface else "",
        derive.sections(interface) if interface else (),
        repr(endpoint.topic.replace("~", planned.node.name)),
        planned.once and len(planned.asking) == 1,
    )
    return endpoint.role.test(context)


def _constants(planned: Plan) -> Iterator[str]:
    """Yield the lines of constants that the tests compare with."""
    node = planned.node
    if node.lifecycle:
        served = (endpoint for endpoint in node.endpoints if endpoint.role.kind)
        offered = (_resolved(endpoint, node.name) for endpoint in served)
        names = sorted(set(map(repr, offered)))
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
    """Return the name of an endpoint in ROS 2's graph."""
    topic = endpoint.topic.replace("~", f"/{node}")
    whole = topic if topic.startswith("/") else f"/{topic}"
    return f"{whole}/_action/send_goal" if endpoint.role.kind == "action" else whole


def packages(planned: Plan) -> list[str]:
    """Return the packages that the test needs besides those of the node."""
    page = Page(planned.messages, taken=_TAKEN)
    parts = tuple(_part(planned, placed, page) for placed in planned.endpoints)
    needed = _collected(planned, parts, page).packages()
    return ["python3-pytest", *sorted(needed - {*planned.packages, planned.node.package})]


def _collected(planned: Plan, parts: tuple[TestPart, ...], page: Page) -> ImportList:
    """Return the imports of the test, besides pytest."""
    node = planned.node
    imports = ImportList(page.imports())
    for endpoint, part in zip(node.endpoints, parts, strict=True):
        imports.add_all(endpoint.role.test_imports)
        imports.add_all(part.imports)
        imports.add("rclpy.qos", *endpoint.qos.imports)
    if node.lifecycle:
        imports.add("lifecycle_msgs.msg", "Transition")
        imports.add("lifecycle_msgs.srv", "ChangeState")
    if node.parameters:
        imports.add("rcl_interfaces.srv", "GetParameters")
        imports.add("rclpy.parameter", "parameter_value_to_python")
    imports.add("rclpy.node", "Node")
    imports.add("collections.abc", "Callable")
    imports.add("typing", "Any")
    return imports
