"""A node and its test: from the plan to what their templates lay out."""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from idlc.generate.templates import Code, code
from idlc.model import derive, ir
from idlc.scaffold import roles, samples, spec
from idlc.scaffold.samples import Page
from idlc.scaffold.spec import NodePlan, ResolvedEndpoint

#: Names that a module of a node uses itself, whatever its roles.
_TAKEN = (
    *("Any", "Callable", "Coroutine", "Event", "ExitStack", "ExternalShutdownException", "Future"),
    *("LifecycleNode", "LifecycleState", "Node", "SignalHandlerOptions", "SingleThreadedExecutor"),
    "TransitionCallbackReturn",
    *(name for preset in roles.QOS_PRESETS for name in (*preset.imports, preset.source)),
    *(name for role in roles.ROLES for names in role.imports.values() for name in names),
    "ok",
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


class Import(NamedTuple):
    """An import of a module, or of names from it; several are on a line each."""

    module: Code
    names: tuple[Code, ...] = ()


class EndpointPart(NamedTuple):
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
    sample: Mapping[str, samples.SampleMessage]
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
    sample: samples.SampleMessage
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
    parts: tuple[EndpointPart, ...]
    requests: tuple[RequestView, ...]
    helpers: frozenset[str]
    lifecycle: bool
    once: bool


def render(planned: NodePlan) -> str:
    """Return the text of a node's module."""
    node = planned.node
    page = Page(planned.messages, clock=CLOCK, taken=_TAKEN, own=node.package)
    parts = [
        _part(placed, page, planned.short, placed.endpoint.role.samples)
        for placed in planned.endpoints
    ]
    page.clock = None  # there is none where the command line is read
    requests = tuple(_short_request(planned, page) if planned.short else _requests(planned, page))
    class_name = "".join(part.capitalize() for part in node.name.split("_"))
    class_name += "Node" if class_name in page.taken else ""
    does = [
        endpoint.role.summary.format(part.title)
        for endpoint, part in zip(node.endpoints, parts, strict=True)
        if endpoint.role.summary
    ]
    view = NodeView(
        name=Code(node.name),
        class_name=Code(class_name),
        does=tuple(map(Code, does)),
        imports=_short_imports(planned, page) if planned.short else _imports(planned, page),
        constants=_constants(node),
        parameters=tuple(map(_parameter, node.parameters)),
        parts=tuple(parts),
        requests=requests,
        helpers=_helpers(node),
        lifecycle=node.lifecycle,
        once=planned.once,
    )
    if planned.short:
        return compact(code().get_template("node/short/module.py.jinja").render(node=view))
    return code().get_template("node/module.py.jinja").render(node=view)


def _part(
    placed: ResolvedEndpoint, page: Page, short: bool, spelled_out: Iterable[str] = ()
) -> EndpointPart:
    """Return an endpoint as its node or its test sees it, with values for some sections."""
    endpoint, word, interface = placed
    messages = derive.sections(interface) if interface else ()
    sections = dict(zip(_VARIABLES[endpoint.role.kind], messages, strict=True))
    sample = {name: samples.sample(sections[name], page) for name in spelled_out}
    seconds = endpoint.period or 1.0
    period = repr(round(seconds, 6))
    if abs(float(period) - seconds) >= seconds * 1e-9:
        period = f"1.0 / {1.0 / seconds:.6g}"
    return EndpointPart(
        template=f"node/{'short/' if short else ''}{endpoint.role.name}.py.jinja",
        word=Code(word),
        title=Code(endpoint.topic if len(endpoint.topic) <= LONGEST_TITLE else word),
        name=Code(repr(endpoint.topic)),
        type=Code(page.use(interface.name) if interface else ""),
        period=Code(period),
        qos=Code(endpoint.qos.source),
        patience=Code(repr(round(PATIENCE + 3 * (endpoint.period or 0.0), 1))),
        sample=sample,
        log={name: samples.logged(section, name) for name, section in sections.items()},
    )


def _helpers(node: spec.NodeSpec) -> frozenset[str]:
    return frozenset().union(*(endpoint.role.helpers for endpoint in node.endpoints))


def _constants(node: spec.NodeSpec) -> tuple[Code, ...]:
    """Return the lines that define constants of qualities of service."""
    lines = (endpoint.qos.constant for endpoint in node.endpoints)
    return tuple(map(Code, dict.fromkeys(filter(None, lines))))


def _parameter(parameter: spec.ParameterSpec) -> ParameterView:
    value = parameter.default
    return ParameterView(
        name=Code(repr(parameter.name)),
        word=Code(parameter.word),
        annotation=Code(parameter.annotation),
        default=Code(repr(list(value) if isinstance(value, tuple) else value)),
    )


def _requests(planned: NodePlan, page: Page) -> Iterator[RequestView]:
    """Yield the requests that a node sends."""
    alone = len(planned.asking) == 1
    for endpoint, word, interface in planned.asking:
        request = endpoint.role.request
        assert request is not None
        assert interface is not None
        message = derive.sections(interface)[0]
        prefix = "" if alone else f"{word}_"
        type_ = Code(page.use(message.name))
        positional = planned.once and alone
        sample, arguments = samples.request(message, page, prefix, positional=positional)
        yield RequestView(
            title=Code(request.title),
            function=Code(f"{word}_request"),
            type=type_,
            method=Code(request.method.format(word)),
            cancel=Code(request.cancel.format(word)),
            sample=sample,
            arguments=arguments,
        )


def _short_request(planned: NodePlan, page: Page) -> Iterator[RequestView]:
    """Yield the request that a short node sends, if there is one, with sensible values."""
    for endpoint, word, interface in planned.asking:
        assert endpoint.role.request is not None
        assert interface is not None
        message = derive.sections(interface)[0]
        yield RequestView(
            title=Code(endpoint.role.request.title),
            function=Code(),
            type=Code(page.use(message.name)),
            method=Code(endpoint.role.request.method.format(word)),
            cancel=Code(),
            sample=samples.sample(message, page),
            arguments=(),
        )


def _short_imports(planned: NodePlan, page: Page) -> tuple[tuple[Import, ...], ...]:
    """Return the imports of a short node, in groups."""
    imports = defaultdict(set, page.imports())
    for endpoint in planned.node.endpoints:
        for module, names in (endpoint.role.short or {}).items():
            imports[module].update(names)
        imports["rclpy.qos"].update(endpoint.qos.imports)
    imports["rclpy.node"].add("Node")
    imports["rclpy.utilities"].add("ok")
    return _import_groups(imports, ("rclpy",))


def _imports(planned: NodePlan, page: Page) -> tuple[tuple[Import, ...], ...]:
    """Return the imports in groups: of the standard library, then all others."""
    node = planned.node
    waits = "pause" in _helpers(node)
    imports = defaultdict(set, page.imports())
    plain = ["rclpy"]
    for endpoint in node.endpoints:
        for module, names in endpoint.role.imports.items():
            imports[module].update(names)
        imports["rclpy.qos"].update(endpoint.qos.imports)
    imports["rclpy.executors"].add("SingleThreadedExecutor")
    imports["rclpy.utilities"].add("ok")
    if waits:
        imports["rclpy.task"].add("Future")
    if planned.asking:
        imports["collections.abc"].add("Callable")
        imports["rclpy.utilities"].add("remove_ros_args")
        plain += ["argparse", "sys", "time"]
    if planned.once:
        imports["rclpy.signals"].add("SignalHandlerOptions")
        imports["rclpy.utilities"].add("try_shutdown")
        imports["threading"].add("Event")
        plain.append("signal")
    else:
        imports["contextlib"].add("suppress")
        imports["rclpy.executors"].add("ExternalShutdownException")
    if node.lifecycle:
        imports["contextlib"].add("ExitStack")
        states = ("LifecycleNode", "LifecycleState", "TransitionCallbackReturn")
        imports["rclpy.lifecycle"].update(states)
        if waits:
            imports["collections.abc"].update(("Callable", "Coroutine"))
            imports["typing"].add("Any")
    else:
        imports["rclpy.node"].add("Node")
    return _import_groups(imports, plain)


def _import_groups(
    names_of: Mapping[str, set[str]], plain: Iterable[str]
) -> tuple[tuple[Import, ...], ...]:
    """Return imports of names, and of `plain` modules, in the order that ament_flake8 wants."""
    imports = [Import(Code(module)) for module in plain]
    for module, names in names_of.items():
        renamed = {name for name in names if " as " in name}
        imports += [Import(Code(module), (Code(name),)) for name in renamed]
        ordered = sorted(names - renamed, key=lambda name: (name.lower(), name))
        imports += [Import(Code(module), tuple(map(Code, ordered)))] if ordered else []
    imports.sort(key=lambda entry: (entry.module.lower(), *map(str.lower, entry.names[:1])))
    groups: tuple[list[Import], list[Import]] = [], []
    for entry in imports:
        groups[entry.module.partition(".")[0] not in sys.stdlib_module_names].append(entry)
    return tuple(tuple(group) for group in groups if group)


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
    parts: tuple[EndpointPart, ...]
    lifecycle: bool
    once: bool
    ends: bool


def render_test(planned: NodePlan) -> str:
    """Return the text of a node's test."""
    node = planned.node
    parts, imports = _tested(planned)
    served = (endpoint for endpoint in node.endpoints if endpoint.role.kind and node.lifecycle)
    plain = ["pytest", "signal"]
    if planned.short:
        acts = any(endpoint.role.name == "action_server" for endpoint in node.endpoints)
        plain = ["pytest"] if acts else []
    view = TestView(
        node=Code(node.name),
        module=Code(f"{node.package}.{node.name}"),
        imports=_import_groups(imports, plain),
        constants=_constants(node),
        offered=tuple(map(Code, sorted({repr(_resolved(each, node.name)) for each in served}))),
        parameters=tuple(map(_parameter, node.parameters)),
        parts=parts,
        lifecycle=node.lifecycle,
        once=planned.once,
        ends=planned.once and len(planned.asking) == 1,
    )
    if planned.short:
        return compact(code().get_template("node/short/test.py.jinja").render(test=view))
    return code().get_template("node/test.py.jinja").render(test=view)


#: The longest line that ament_flake8 accepts.
WIDTH = 99


def compact(text: str) -> str:
    """Return source whose brackets are on one line where it fits, as `ruff format` puts them.

    The text has each item of a bracket on a line of its own, with a comma.
    """
    lines: list[str] = []
    for line in text.splitlines():
        closing = line.strip()
        if closing[:1] not in tuple(")]}"):
            lines.append(line)
            continue
        margin = line[: -len(closing)]
        opening = max(n for n, other in enumerate(lines) if other and _indent(other) == margin)
        items = lines[opening + 1 :]
        inner = f"{margin}    "
        body = " ".join(item.strip() for item in items).removesuffix(",")
        joined = f"{lines[opening]}{body}{closing}"
        if lines[opening].endswith("import ("):
            joined = f"{lines[opening].removesuffix('(')}{body}"
        flat = all(_indent(item) == inner and item.strip()[0] != "#" for item in items)
        if flat and len(joined) <= WIDTH:
            lines[opening:] = [joined]
        elif flat and items and len(inner + body) <= WIDTH:
            lines[opening + 1 :] = [inner + body, line]
        else:
            lines.append(line)
    return "\n".join([*lines, ""])


def _indent(line: str) -> str:
    return line[: len(line) - len(line.lstrip())]


def _resolved(endpoint: roles.EndpointSpec, node: str) -> str:
    """Return the name of an endpoint in ROS 2's graph."""
    topic = endpoint.topic.replace("~", f"/{node}")
    whole = topic if topic.startswith("/") else f"/{topic}"
    return f"{whole}/_action/send_goal" if endpoint.role.kind == "action" else whole


def test_packages(planned: NodePlan) -> list[str]:
    """Return the packages that the test and its conftest.py need besides those of the node."""
    packages = {module.partition(".")[0] for module in _tested(planned)[1]} | {"rclpy"}
    if not planned.short:
        packages.add("rcl_interfaces")
    others = packages - sys.stdlib_module_names - {*planned.packages, planned.node.package}
    return ["python3-pytest", *sorted(others)]


def _tested(planned: NodePlan) -> tuple[tuple[EndpointPart, ...], Mapping[str, set[str]]]:
    """Return the endpoints as a test sees them, and its imports besides pytest."""
    node = planned.node
    page = Page(planned.messages, taken=_TAKEN_BY_TESTS)
    parts = [
        _part(placed, page, planned.short)._replace(
            name=Code(repr(placed.endpoint.topic.replace("~", node.name)))
        )
        for placed in planned.endpoints
    ]
    imports = defaultdict(set, page.imports())
    for endpoint in node.endpoints:
        role = endpoint.role
        for module, names in (role.short_test if planned.short else role.test_imports).items():
            imports[module].update(names)
        imports["rclpy.qos"].update(endpoint.qos.imports)
    if node.lifecycle:
        imports["lifecycle_msgs.msg"].add("Transition")
        imports["lifecycle_msgs.srv"].add("ChangeState")
    if node.parameters or (planned.short and not node.endpoints):
        imports["rcl_interfaces.srv"].add("GetParameters")
        imports["rclpy.parameter"].add("parameter_value_to_python")
    if not planned.short:
        imports["rclpy.node"].add("Node")
        imports["collections.abc"].add("Callable")
    imports["typing"].add("Any")
    return tuple(parts), imports
