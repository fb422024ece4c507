"""A node and its test: from the plan to what their templates lay out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from idlc.model import derive, ir
from idlc.project.templates import Code
from idlc.scaffold import roles, samples, spec
from idlc.scaffold.imports import Import, ImportList
from idlc.scaffold.samples import Page
from idlc.scaffold.spec import Placed, Plan
from idlc.scaffold.templates import Templates

#: Names that a module of a node uses itself, whatever its roles.
_TAKEN = (
    *("Any", "Callable", "Coroutine", "Event", "ExitStack", "ExternalShutdownException", "Future"),
    *("LifecycleNode", "LifecycleState", "Node", "SignalHandlerOptions", "SingleThreadedExecutor"),
    "TransitionCallbackReturn",
    *(name for preset in roles.QOS_PRESETS for name in (*preset.imports, preset.source)),
    *(name for role in roles.ROLES for names in role.imports.values() for name in names),
)
#: Names that a test uses itself.
_TAKEN_BY_TESTS = (
    *("Any", "Callable", "ChangeState", "Future", "GetParameters", "Node", "Start", "Transition"),
    *("MODULE", "OFFERED", "PARAMETERS", "CancelResponse"),
    *(name for preset in roles.QOS_PRESETS for name in (*preset.imports, preset.source)),
    *(name for role in roles.ROLES for names in role.test_imports.values() for name in names),
)
#: Longer topics are replaced by their word in text.
LONGEST_TITLE = 30
#: Seconds that a test waits for a first message, besides what the node waits itself.
PATIENCE = 20.0
CLOCK = "self.get_clock().now().to_msg()"
#: The variables of a node that hold the sections of an interface.
_VARIABLES: Mapping[ir.Kind | None, tuple[str, ...]] = {
    "msg": ("message",),
    "srv": ("request", "response"),
    "action": ("goal", "result", "feedback"),
    None: (),
}


class Part(NamedTuple):
    """An endpoint: `word` is for names, `title` for text, `name` the literal of its name in ROS 2.

    `template` has the sections of its role. `sample` has values for the sections of the interface
    that the role spells out, `log` for each the replacement field of an f-string that shows it.
    `patience` is the number of seconds in which two messages come.
    """

    template: str
    word: Code
    title: Code
    name: Code
    type: Code
    period: Code
    qos: Code
    patience: Code
    sample: Mapping[str, samples.Sample]
    log: Mapping[str, Code]


class ParameterView(NamedTuple):
    """A parameter and its property: its names in ROS 2 and in Python, its type, its default."""

    name: Code
    word: Code
    annotation: Code
    default: Code

    @property
    def is_list(self) -> bool:
        """True if it has several values."""
        return self.annotation.startswith("list")


class RequestView(NamedTuple):
    """A request that a node sends, and the arguments of the command line that describe it.

    `title` is in text; `function` makes the request, of class `type`, and the coroutine `method`
    sends it. `cancel` is the coroutine that cancels it, if there is one.
    """

    title: Code
    function: Code
    type: Code
    method: Code
    cancel: Code
    sample: samples.Sample
    arguments: tuple[samples.Argument, ...]


class NodeView(NamedTuple):
    """The content of a node's template.

    `does` has a phrase for each endpoint. `helpers` are the methods that its parts need: `pause`,
    `until`, `retire`. A node that runs `once` only sends its requests.
    """

    name: Code
    class_name: Code
    does: tuple[Code, ...]
    imports: tuple[tuple[Import, ...], ...]
    constants: tuple[Code, ...]
    parameters: tuple[ParameterView, ...]
    parts: tuple[Part, ...]
    requests: tuple[RequestView, ...]
    helpers: frozenset[str]
    lifecycle: bool
    once: bool


def render(planned: Plan, templates: Templates) -> str:
    """Return the text of a node's module."""
    return templates.render("node/module.py.jinja", node=view(planned))


def view(planned: Plan) -> NodeView:
    """Return what a node's module shows."""
    node = planned.node
    page = Page(planned.messages, clock=CLOCK, taken=_TAKEN, own=node.package)
    parts = tuple(_part(placed, page) for placed in planned.endpoints)
    page.clock = None  # there is none where the command line is read
    requests = tuple(_requests(planned, page))
    class_name = spec.class_name(node.name)
    class_name += "Node" if class_name in page.names or class_name in _TAKEN else ""
    does = (
        Code(f"{endpoint.role.summary} {part.title}")
        for endpoint, part in zip(node.endpoints, parts, strict=True)
        if endpoint.role.summary
    )
    return NodeView(
        name=Code(node.name),
        class_name=Code(class_name),
        does=tuple(does),
        imports=_imports(planned, page),
        constants=_constants(node),
        parameters=tuple(map(_parameter, node.parameters)),
        parts=parts,
        requests=requests,
        helpers=_helpers(node),
        lifecycle=node.lifecycle,
        once=planned.once,
    )


def _part(placed: Placed, page: Page) -> Part:
    """Return an endpoint as its node sees it."""
    sections = dict(_sections(placed))
    sample = {name: samples.sample(sections[name], page) for name in placed.endpoint.role.samples}
    return _bare_part(placed, page)._replace(sample=sample)


def _bare_part(placed: Placed, page: Page) -> Part:
    """Return an endpoint without values of messages."""
    endpoint, word, interface = placed
    sections = _sections(placed)
    return Part(
        template=f"node/{endpoint.role.name}.py.jinja",
        word=Code(word),
        title=Code(endpoint.topic if len(endpoint.topic) <= LONGEST_TITLE else word),
        name=Code(repr(endpoint.topic)),
        type=Code(page.use(interface.name) if interface else ""),
        period=_interval(endpoint.period or 1.0),
        qos=Code(endpoint.qos.source),
        patience=Code(repr(round(PATIENCE + 3 * (endpoint.period or 0.0), 1))),
        sample={},
        log={variable: samples.logged(section, variable) for variable, section in sections},
    )


def _sections(placed: Placed) -> tuple[tuple[str, ir.Message], ...]:
    """Return the messages of an interface by the variables of a node that hold them."""
    sections = derive.sections(placed.interface) if placed.interface else ()
    return tuple(zip(_VARIABLES[placed.endpoint.role.kind], sections, strict=True))


def _interval(seconds: float) -> Code:
    """Return a period in seconds as source."""
    text = repr(round(seconds, 6))
    exact = abs(float(text) - seconds) < seconds * 1e-9
    return Code(text if exact else f"1.0 / {1.0 / seconds:.6g}")


def _helpers(node: spec.Node) -> frozenset[str]:
    return frozenset().union(*(endpoint.role.helpers for endpoint in node.endpoints))


def _constants(node: spec.Node) -> tuple[Code, ...]:
    """Return the lines that define constants of qualities of service."""
    lines = (endpoint.qos.constant for endpoint in node.endpoints)
    return tuple(map(Code, dict.fromkeys(filter(None, lines))))


def _parameter(parameter: spec.Parameter) -> ParameterView:
    value = parameter.default
    return ParameterView(
        name=Code(repr(parameter.name)),
        word=Code(parameter.word),
        annotation=Code(parameter.annotation),
        default=Code(repr(list(value) if isinstance(value, tuple) else value)),
    )


def _requests(planned: Plan, page: Page) -> Iterator[RequestView]:
    """Yield the requests that a node sends."""
    alone = len(planned.asking) == 1
    for request, word, interface in planned.asking:
        message = derive.sections(interface)[0]
        prefix = "" if alone else f"{word}_"
        positional = planned.once and alone
        yield RequestView(
            title=Code(request.title),
            function=Code(f"{word}_request"),
            type=Code(page.use(message.name)),
            method=Code(request.method.format(word)),
            cancel=Code(request.cancel.format(word)),
            sample=samples.from_arguments(message, page, prefix),
            arguments=tuple(samples.arguments(message, page, prefix, positional=positional)),
        )


def _imports(planned: Plan, page: Page) -> tuple[tuple[Import, ...], ...]:
    """Return the imports in groups: of the standard library, then all others."""
    node = planned.node
    waits = "pause" in _helpers(node)
    imports = ImportList(page.imports())
    plain = ["rclpy"]
    for endpoint in node.endpoints:
        imports.add_all(endpoint.role.imports)
        imports.add("rclpy.qos", *endpoint.qos.imports)
    imports.add("rclpy.executors", "SingleThreadedExecutor")
    imports.add("rclpy.utilities", "ok")
    if waits:
        imports.add("rclpy.task", "Future")
    if planned.asking:
        imports.add("collections.abc", "Callable")
        imports.add("rclpy.utilities", "remove_ros_args")
        plain += ["argparse", "sys", "time"]
    if planned.once:
        imports.add("rclpy.signals", "SignalHandlerOptions")
        imports.add("rclpy.utilities", "try_shutdown")
        imports.add("threading", "Event")
        plain.append("signal")
    else:
        imports.add("rclpy.executors", "ExternalShutdownException")
    if node.lifecycle:
        imports.add("contextlib", "ExitStack")
        states = ("LifecycleNode", "LifecycleState", "TransitionCallbackReturn")
        imports.add("rclpy.lifecycle", *states)
        if waits:
            imports.add("collections.abc", "Callable", "Coroutine")
            imports.add("typing", "Any")
    else:
        imports.add("rclpy.node", "Node")
    return imports.groups(plain)


class TestView(NamedTuple):
    """The content of a test's template.

    `offered` are the literals of the names that a lifecycle node offers. A node that `ends` has
    done its work with the first answer.
    """

    node: Code
    module: Code
    imports: tuple[tuple[Import, ...], ...]
    constants: tuple[Code, ...]
    offered: tuple[Code, ...]
    parameters: tuple[ParameterView, ...]
    parts: tuple[Part, ...]
    lifecycle: bool
    once: bool
    ends: bool


def render_test(planned: Plan, templates: Templates) -> str:
    """Return the text of a node's test."""
    return templates.render("node/test.py.jinja", test=view_of_test(planned))


def view_of_test(planned: Plan) -> TestView:
    """Return what a node's test shows."""
    node = planned.node
    parts, imports = _tested(planned)
    served = (endpoint for endpoint in node.endpoints if endpoint.role.kind and node.lifecycle)
    return TestView(
        node=Code(node.name),
        module=Code(f"{node.package}.{node.name}"),
        imports=imports.groups(("pytest", "signal")),
        constants=_constants(node),
        offered=tuple(map(Code, sorted({repr(_resolved(each, node.name)) for each in served}))),
        parameters=tuple(map(_parameter, node.parameters)),
        parts=parts,
        lifecycle=node.lifecycle,
        once=planned.once,
        ends=planned.once and len(planned.asking) == 1,
    )


def _resolved(endpoint: roles.Endpoint, node: str) -> str:
    """Return the name of an endpoint in ROS 2's graph."""
    topic = endpoint.topic.replace("~", f"/{node}")
    whole = topic if topic.startswith("/") else f"/{topic}"
    return f"{whole}/_action/send_goal" if endpoint.role.kind == "action" else whole


def test_packages(planned: Plan) -> list[str]:
    """Return the packages that the test needs besides those of the node."""
    _, imports = _tested(planned)
    return [
        "python3-pytest",
        *sorted(imports.packages() - {*planned.packages, planned.node.package}),
    ]


def _tested(planned: Plan) -> tuple[tuple[Part, ...], ImportList]:
    """Return the endpoints as a test sees them, and its imports besides pytest."""
    node = planned.node
    page = Page(planned.messages, taken=_TAKEN_BY_TESTS)
    parts = tuple(
        _bare_part(placed, page)._replace(
            name=Code(repr(placed.endpoint.topic.replace("~", node.name))),
        )
        for placed in planned.endpoints
    )
    imports = ImportList(page.imports())
    for endpoint in node.endpoints:
        imports.add_all(endpoint.role.test_imports)
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
    return parts, imports
