"""A node's module: from what it is to do to the lines that its template lays out."""

from __future__ import annotations

from typing import NamedTuple

from idlc.model import derive
from idlc.scaffold import arguments, spec
from idlc.scaffold.endpoints import IMPORTS, LATCHED, QOS_IMPORTS, Endpoints, Part
from idlc.scaffold.line_breaks import call, imports
from idlc.scaffold.planned import Plan
from idlc.scaffold.samples import INDENT, Page
from idlc.scaffold.states import PAUSING, StatesView, kept, pauses, states
from idlc.templating import environment

#: Names that a module of a node uses itself.
_OWN = (
    *(
        "Any",
        "Callable",
        "Coroutine",
        "ExternalShutdownException",
        "Future",
        "LifecycleNode",
        "LifecycleState",
    ),
    *(
        "ExitStack",
        "Node",
        "SignalHandlerOptions",
        "SingleThreadedExecutor",
        "TransitionCallbackReturn",
    ),
    *("ActionServer", "ActionClient", "CancelResponse", "ClientGoalHandle", "GoalResponse"),
    *("Event", "GoalStatus", "ServerGoalHandle", "DurabilityPolicy", "QoSProfile", "LATCHED"),
)
_STANDARD = {"argparse", "collections.abc", "contextlib", "sys", "time", "threading", "typing"}
#: The longest description of a node that fits wherever it stands.
SUMMARY = 70
CLOCK = "self.get_clock().now().to_msg()"
TIMEOUT = "server_timeout"


class ParameterView(NamedTuple):
    """A parameter as its property shows it."""

    name: str
    word: str
    annotation: str
    value: str


class MainView(NamedTuple):
    """The function that runs the node, and the command line that it reads."""

    template: str
    run: str
    init_arguments: str
    before: tuple[str, ...]
    tasks: tuple[str, ...]
    cancels: tuple[str, ...]
    arguments: tuple[str, ...]
    requests: tuple[arguments.RequestView, ...]


class NodeView(NamedTuple):
    """What the template shows; lines are finished, without their indentation."""

    name: str
    class_name: str
    base: str
    summary: str
    imports: tuple[tuple[str, ...], ...]
    constants: tuple[str, ...]
    init_head: str
    setup: tuple[str, ...]
    parameters: tuple[ParameterView, ...]
    parts: tuple[Part, ...]
    timers: tuple[str, ...]
    pauses: bool
    retires: bool
    has_arguments: bool
    lifecycle: bool
    states: StatesView
    main: MainView


def render(planned: Plan) -> str:
    """Return the text of a node's module."""
    return environment().get_template("node/module.py.jinja").render(node=view(planned))


def view(planned: Plan) -> NodeView:
    """Return the lines of a node's module."""
    node = planned.node
    page = Page(planned.messages, clock=CLOCK, taken=_OWN, own=node.package)
    endpoints = Endpoints(page, lifecycle=node.lifecycle)
    triples = zip(node.endpoints, planned.words, planned.interfaces, strict=True)
    parts = tuple(endpoints.part(*one) for one in triples)
    page.clock = None  # there is none where the command line is read
    main = _main(planned, page)
    timers = tuple("tick" if n == 0 else f"tick_{n + 1}" for n in range(len(node.timers)))
    steps = states(node, parts, timers, _tasks(planned))
    given = _given(planned)
    created = () if node.lifecycle else (*steps.on_configure, *steps.on_activate)
    class_name = spec.class_name(node.name)
    taken = class_name in page.names or class_name in _OWN
    return NodeView(
        name=node.name,
        class_name=f"{class_name}Node" if taken else class_name,
        base="LifecycleNode" if node.lifecycle else "Node",
        summary=_summary(node),
        imports=_imports(planned, page),
        constants=_constants(node),
        init_head=given.head,
        setup=(*given.setup, *kept(node, parts), *_declarations(node), *created),
        parameters=tuple(map(_parameter, node.parameters)),
        parts=parts,
        timers=timers,
        pauses=pauses(parts),
        retires=node.lifecycle and any("action" in part.role for part in parts),
        has_arguments=bool(planned.clients),
        lifecycle=node.lifecycle,
        states=steps,
        main=main,
    )


def _main(planned: Plan, page: Page) -> MainView:
    requests, declared = _requests(planned, page)
    has_arguments = bool(planned.clients)
    goals = [word for endpoint, word, _ in planned.clients if endpoint.role == "action_client"]
    return MainView(
        template="node/main_once.py.jinja" if planned.once else "node/main.py.jinja",
        run="sys.exit(main())" if planned.once else "main()",
        init_arguments=_given(planned).call,
        before=("given = parse_arguments(args)",) if has_arguments else (),
        tasks=_given_tasks(planned),
        cancels=tuple(f"node.cancel_{word}" for word in goals),
        arguments=tuple(declared),
        requests=tuple(requests),
    )


_DOES = {
    "publisher": "publishes {}",
    "subscriber": "listens to {}",
    "service": "serves {}",
    "client": "calls {}",
    "action_server": "works on goals for {}",
    "action_client": "sends goals to {}",
}


def _summary(node: spec.Node) -> str:
    """Return what the node does, if that fits into a line."""
    kind = "lifecycle node" if node.lifecycle else "node"
    does = [_DOES[endpoint.role].format(endpoint.topic) for endpoint in node.endpoints]
    *most, last = does or [""]
    said = f"{', '.join(most)} and {last}" if most else last
    text = f"The {kind} {node.name} {said}.".replace(" .", ".")
    return text if len(text) <= SUMMARY else f"The {kind} {node.name}."


def _constants(node: spec.Node) -> tuple[str, ...]:
    latched = any(endpoint.qos == "latched" for endpoint in node.endpoints)
    return (LATCHED, "") if latched else ()


def _declarations(node: spec.Node) -> list[str]:
    found = []
    for one in node.parameters:
        default = list(one.default) if isinstance(one.default, tuple) else one.default
        found.append(f"self.declare_parameter({one.name!r}, {default!r})")
    return found


def _parameter(one: spec.Parameter) -> ParameterView:
    value = f"self.get_parameter({one.name!r}).value"
    several = one.annotation.startswith("list")
    return ParameterView(one.name, one.word, one.annotation, f"list({value})" if several else value)


def _requests(planned: Plan, page: Page) -> tuple[list[arguments.RequestView], list[str]]:
    """Return the functions that make requests, and the lines that declare their arguments."""
    clients = planned.clients
    requests, declared = [], []
    for endpoint, word, interface in clients:
        message = derive.sections(interface)[0]
        prefix = "" if len(clients) == 1 else f"{word}_"
        what = "the goal" if endpoint.role == "action_client" else "the request"
        requests.append(arguments.request(message, page, word, what, prefix))
        positional = planned.once and len(clients) == 1
        declared += arguments.lines(message, page, prefix, positional=positional)
    return requests, declared


def _tasks(planned: Plan) -> list[tuple[str, str]]:
    """Return the method that each client's work begins with, and what it is given."""
    verbs = {"client": "call", "action_client": "send"}
    return [(f"{verbs[e.role]}_{word}", f"{word}_request") for e, word, _ in planned.clients]


def _given_tasks(planned: Plan) -> tuple[str, ...]:
    """Return what `main` starts: what clients do, unless they wait for the node's activation."""
    if planned.node.lifecycle:
        return ()
    head = "task = executor.create_task" if planned.once else "executor.create_task"
    calls = (
        call(head, [f"node.{method}", f"{request}(given)"], depth=2)
        for method, request in _tasks(planned)
    )
    return tuple(
        "\n".join([first, *(INDENT * 2 + line for line in rest)]) for first, *rest in calls
    )


class _Given(NamedTuple):
    head: str
    setup: tuple[str, ...]
    call: str


def _given(planned: Plan) -> _Given:
    """Return how the class is told what the command line says."""
    if not planned.clients:
        return _Given("def __init__(self) -> None:", (), "")
    if planned.node.lifecycle:
        setup = ("self.given = given", f"self.timeout: float = given.{TIMEOUT}")
        return _Given("def __init__(self, given: argparse.Namespace) -> None:", setup, "given")
    head = "def __init__(self, timeout: float) -> None:"
    return _Given(head, ("self.timeout = timeout",), f"given.{TIMEOUT}")


def _imports(planned: Plan, page: Page) -> tuple[tuple[str, ...], ...]:
    """Return the import lines in groups: the standard library, then everything else."""
    node = planned.node
    names: dict[str, set[str]] = {name: set(found) for name, found in page.imports().items()}

    def add(module: str, *found: str) -> None:
        if found:
            names.setdefault(module, set()).update(found)

    for endpoint in node.endpoints:
        for module, found in IMPORTS.get(endpoint.role, {}).items():
            add(module, *found)
        add("rclpy.qos", *QOS_IMPORTS[endpoint.qos])
    roles = {endpoint.role for endpoint in node.endpoints}
    if roles & PAUSING:
        add("rclpy.task", "Future")
    if planned.clients:
        add("collections.abc", "Callable")
        add("rclpy.utilities", "remove_ros_args")
    add("rclpy.utilities", "try_shutdown")
    add("rclpy.executors", "ExternalShutdownException", "SingleThreadedExecutor")
    if planned.once:
        add("rclpy.signals", "SignalHandlerOptions")
        add("threading", "Event")
    else:
        add("rclpy.utilities", "ok")
    if node.lifecycle:
        add("contextlib", "ExitStack")
        if roles & PAUSING:
            add("collections.abc", "Callable", "Coroutine")
            add("typing", "Any")
        add("rclpy.lifecycle", "LifecycleNode", "LifecycleState", "TransitionCallbackReturn")
    else:
        add("rclpy.node", "Node")
    standard = {module: found for module, found in names.items() if module in _STANDARD}
    others = {module: found for module, found in names.items() if module not in _STANDARD}
    reading = ("argparse", "sys", "time") if planned.clients else ()
    plain = (*reading, *(("signal",) if planned.once else ()))
    groups = (imports(standard, plain), imports(others, ("rclpy",)))
    return tuple(tuple(group) for group in groups if group)
