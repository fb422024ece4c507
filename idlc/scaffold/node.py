"""A node's module: from its plan to the lines that its template lays out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from idlc.model import derive
from idlc.scaffold import samples, spec
from idlc.scaffold.layout import ImportList, call, collection
from idlc.scaffold.roles import ROLES, role
from idlc.scaffold.roles.role import ACTIVATE, Context, Endpoint, Part, TestContext, TestPart, undo
from idlc.scaffold.samples import Page
from idlc.scaffold.spec import Placed, Plan
from idlc.scaffold.templates import Templates


class StatesView(NamedTuple):
    """The statements of a lifecycle node for changes of its state."""

    on_configure: tuple[str, ...]
    on_activate: tuple[str, ...]


def plain(parts: Sequence[Part]) -> tuple[str, ...]:
    """Return the lines that set up a node without a lifecycle."""
    return (*_lines(parts, "remember"), *_lines(parts, "create"), *_lines(parts, "work"))


def remembered(parts: Sequence[Part], *, waits: bool) -> tuple[str, ...]:
    """Return the lines that set up what a lifecycle node remembers."""
    steps = ("self.undo_configure = ExitStack()", "self.undo_activate = ExitStack()")
    pauses = ("self.activation: object = None", "self.pauses: set[Future] = set()")
    return (*steps, *(pauses if waits else ()), *_lines(parts, "remember"))


def states(parts: Sequence[Part], tasks: Iterable[tuple[str, str]], *, waits: bool) -> StatesView:
    """Return the statements of a lifecycle node for being configured and activated.

    `tasks` are the methods that begin to ask others, each with the function that makes a request.
    A node that `waits` has coroutines, which must know how long it is active.
    """
    begun = ("self.activation = object()", *undo(ACTIVATE, "self.wake")) if waits else ()
    started = [
        line
        for method, request in tasks
        for line in call("self.spawn", [f"self.{method}", f"{request}(self.given)"], depth=2)
    ]
    work = (*begun, *_lines(parts, "work"), *started)
    return StatesView(on_configure=_lines(parts, "create"), on_activate=work)


def _lines(parts: Iterable[Part], which: str) -> tuple[str, ...]:
    return tuple(line for part in parts for line in getattr(part, which))


#: The module of the package with the functions that every `main` needs.
MAIN_MODULE = "node_main"
#: Names that a module of a node uses itself, whatever its roles.
_OWN = (
    *("Any", "Callable", "Coroutine", "ExitStack", "Future", "WakingExecutor"),
    *("LifecycleNode", "LifecycleState", "Node", "TransitionCallbackReturn"),
    *(name for preset in role.QOS_PRESETS for name in (*preset.imports, preset.source)),
    *(name for role in ROLES for names in role.imports.values() for name in names),
)
#: The longest description of a node that fits everywhere.
SUMMARY = 70
CLOCK = "self.get_clock().now().to_msg()"
TIMEOUT = "server_timeout"


class ParameterView(NamedTuple):
    """A parameter and its property: its name, its name in Python, its type and its value."""

    name: str
    word: str
    annotation: str
    value: str


class MainView(NamedTuple):
    """The function `main`: its template, and its statements.

    `run` calls it, `node` makes the node. `tasks` start what the node asks others for;
    `arguments` are the lines that declare the command line, `requests` the functions that make
    requests of it.
    """

    template: str
    run: str
    node: str
    tasks: tuple[str, ...]
    arguments: tuple[str, ...]
    requests: tuple[samples.RequestView, ...]


class NodeView(NamedTuple):
    """The content of a node's template; lines are finished, without their indentation.

    `base` is the class that it extends, `setup` its `__init__`, `states` its statements for changes
    of its lifecycle. `has_pause`, `has_until` and `has_retire` say which methods
    its parts need.
    """

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
    has_pause: bool
    has_until: bool
    has_retire: bool
    has_arguments: bool
    lifecycle: bool
    states: StatesView
    main: MainView


def render(planned: Plan, templates: Templates) -> str:
    """Return the text of a node's module."""
    return templates.render("node/module.py.jinja", node=view(planned))


def view(planned: Plan) -> NodeView:
    """Return the lines of a node's module."""
    node = planned.node
    page = Page(planned.messages, clock=CLOCK, taken=_OWN, own=node.package)
    parts = _parts(planned, page)
    page.clock = None  # there is none where the command line is read
    class_name = spec.class_name(node.name)
    class_name += "Node" if class_name in page.names or class_name in _OWN else ""
    main = _main(planned, page, class_name)
    constructor, helpers = _constructor(planned), _helpers(node)
    waits = "pause" in helpers
    created = remembered(parts, waits=waits) if node.lifecycle else ()
    begun = () if node.lifecycle else plain(parts)
    return NodeView(
        name=node.name,
        class_name=class_name,
        base="LifecycleNode" if node.lifecycle else "Node",
        summary=_summary(node),
        imports=_imports(planned, page),
        constants=node_constants(node),
        init_head=constructor.head,
        setup=(*constructor.setup, *created, *_declarations(node), *begun),
        parameters=tuple(map(_parameter, node.parameters)),
        parts=parts,
        has_pause=waits,
        has_until="until" in helpers,
        has_retire="retire" in helpers and node.lifecycle,
        has_arguments=bool(planned.asking),
        lifecycle=node.lifecycle,
        states=states(parts, _tasks(planned), waits=waits),
        main=main,
    )


def _parts(planned: Plan, page: Page) -> tuple[Part, ...]:
    parts = []
    for endpoint, word, interface in planned.endpoints:
        type_ = page.use(interface.name) if interface else ""
        sections = derive.sections(interface) if interface else ()
        context = Context(endpoint, word, type_, sections, page, planned.node.lifecycle)
        parts.append(endpoint.role.node(context))
    return tuple(parts)


def _helpers(node: spec.Node) -> set[str]:
    return {helper for endpoint in node.endpoints for helper in endpoint.role.helpers}


def _main(planned: Plan, page: Page, class_name: str) -> MainView:
    requests, declared = _requests(planned, page)
    return MainView(
        template="node/main_once.py.jinja" if planned.once else "node/main.py.jinja",
        run="sys.exit(main())" if planned.once else "main()",
        node=f"{class_name}({_constructor(planned).call})",
        tasks=_started(planned),
        arguments=tuple(declared),
        requests=tuple(requests),
    )


def _summary(node: spec.Node) -> str:
    """Return a summary of the node, with its roles if they fit into a line."""
    kind = "lifecycle node" if node.lifecycle else "node"
    summaries = ((endpoint.role.summary, endpoint.topic) for endpoint in node.endpoints)
    does = [summary.format(topic) for summary, topic in summaries if summary]
    *most, last = does or [""]
    phrase = f"{', '.join(most)} and {last}" if most else last
    text = f"The {kind} {node.name} {phrase}.".replace(" .", ".")
    return text if len(text) <= SUMMARY else f"The {kind} {node.name}."


def node_constants(node: spec.Node) -> tuple[str, ...]:
    """Return the lines that define constants of qualities of service."""
    lines = {endpoint.qos.constant: None for endpoint in node.endpoints if endpoint.qos.constant}
    return (*lines, "") if lines else ()


def _declarations(node: spec.Node) -> list[str]:
    lines = []
    for parameter in node.parameters:
        default = (
            list(parameter.default) if isinstance(parameter.default, tuple) else parameter.default
        )
        lines.append(f"self.declare_parameter({parameter.name!r}, {default!r})")
    return lines


def _parameter(parameter: spec.Parameter) -> ParameterView:
    value = f"self.get_parameter({parameter.name!r}).value"
    several = parameter.annotation.startswith("list")
    value = f"list({value})" if several else value
    return ParameterView(parameter.name, parameter.word, parameter.annotation, value)


def _requests(planned: Plan, page: Page) -> tuple[list[samples.RequestView], list[str]]:
    """Return the functions that make requests, and the lines that declare their arguments."""
    asking = planned.asking
    requests, declared = [], []
    for request, word, interface in asking:
        message = derive.sections(interface)[0]
        prefix = "" if len(asking) == 1 else f"{word}_"
        requests.append(samples.request(message, page, word, request.title, prefix))
        positional = planned.once and len(asking) == 1
        declared += samples.lines(message, page, prefix, positional=positional)
    return requests, declared


def _tasks(planned: Plan) -> list[tuple[str, str]]:
    """Return the methods that begin to ask others, each with the function that makes a request."""
    methods = ((asking.request.method, asking.word) for asking in planned.asking)
    return [(f"{method}_{word}", f"{word}_request") for method, word in methods]


def _started(planned: Plan) -> tuple[str, ...]:
    """Return the lines that start tasks in `main`, unless they wait for the node's activation."""
    if planned.node.lifecycle:
        return ()
    calls = []
    for asking, (method, request) in zip(planned.asking, _tasks(planned), strict=True):
        words = [f"node.{method}", f"{request}(given)"]
        if planned.once:
            undone = (
                [f"node.{asking.request.cancel}_{asking.word}"] if asking.request.cancel else []
            )
            calls.append(call("once.run", ["node", *words, *undone], depth=2))
        else:
            calls.append(call("executor.create_task", words, depth=1))
    return tuple(line for lines in calls for line in lines)


class _Constructor(NamedTuple):
    head: str
    setup: tuple[str, ...]
    call: str


def _constructor(planned: Plan) -> _Constructor:
    """Return the constructor, which takes the arguments of the command line."""
    if not planned.asking:
        return _Constructor("def __init__(self) -> None:", (), "")
    if planned.node.lifecycle:
        setup = ("self.given = given", f"self.timeout: float = given.{TIMEOUT}")
        head = "def __init__(self, given: argparse.Namespace) -> None:"
        return _Constructor(head, setup, "given")
    head = "def __init__(self, timeout: float) -> None:"
    return _Constructor(head, ("self.timeout = timeout",), f"given.{TIMEOUT}")


def _imports(planned: Plan, page: Page) -> tuple[tuple[str, ...], ...]:
    """Return the import lines in groups: the standard library, then everything else."""
    node = planned.node
    waits = "pause" in _helpers(node)
    imports = ImportList(page.imports())
    for endpoint in node.endpoints:
        imports.add_all(endpoint.role.imports)
        imports.add("rclpy.qos", *endpoint.qos.imports)
    if waits:
        imports.add("rclpy.task", "Future")
    if planned.asking:
        imports.add("collections.abc", "Callable")
        imports.add("rclpy.utilities", "remove_ros_args")
    main = ("interruptible",) if planned.once else ("until_shutdown", "WakingExecutor")
    imports.add(f"{node.package}.{MAIN_MODULE}", *main)
    if node.lifecycle:
        imports.add("contextlib", "ExitStack")
        states = ("LifecycleNode", "LifecycleState", "TransitionCallbackReturn")
        imports.add("rclpy.lifecycle", *states)
        if waits:
            imports.add("collections.abc", "Callable", "Coroutine")
            imports.add("typing", "Any")
    else:
        imports.add("rclpy.node", "Node")
    reading = ("argparse", "sys", "time") if planned.asking else ()
    return imports.groups((*reading, *(() if planned.once else ("rclpy",))))


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


def render_test(planned: Plan, templates: Templates) -> str:
    """Return the text of a node's test."""
    return templates.render("node_test/module.py.jinja", test=view_of_test(planned))


def view_of_test(planned: Plan) -> TestView:
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


def test_packages(planned: Plan) -> list[str]:
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
