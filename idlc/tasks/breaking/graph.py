"""The running ROS 2 graph, through rclpy: its endpoints, and the nodes' descriptions of types.

The user's environment selects the graph (ROS_DOMAIN_ID and the middleware's variables).
"""

from __future__ import annotations

import os
import re
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from itertools import chain
from typing import Any, NamedTuple, TypeAlias, get_args

from idlc.compiler.compiler import Compiler, stage
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, ReportedError, first_few
from idlc.model import ir
from idlc.model.from_description import DescriptionError, reported_model
from idlc.model.link import Model
from idlc.project import inputs
from idlc.project.find import list_files, no_interfaces
from idlc.project.library import Library
from idlc.project.settings import Scope
from idlc.project.words import is_address
from idlc.robot.keys import Entity as RobotEntity
from idlc.robot.keys import EntityKind
from idlc.robot.live import connect
from idlc.robot.live.graph import (
    Answer,
    Communication,
    EndpointRole,
    GraphEndpoint,
    LocalType,
    Reported,
    TypeQuestion,
    TypeVersion,
    answer_of,
    event_of,
    interface_of,
    service_of,
    several_types,
    several_versions,
    version_changes,
)
from idlc.robot.live.types import ask
from idlc.robot.session import Session
from idlc.tasks.breaking.files import (
    BreakingOptions,
    error_free_models,
    judge,
    report_nothing,
    report_skipped,
)
from idlc.versions.packages import Skipped
from idlc.wire.layout import oversized

#: A graph that never comes to rest is watched for this many times the patience.
RESTLESS = 10
#: Nodes that are asked about one version.
ASKED = 8
_PAUSE = 0.1
#: The names in DDS of a request's or a reply's topic, and of a structure.
_SERVICE = re.compile(r"r([qr])(/.+)(?:Request|Reply)")
_TYPE = re.compile(r"(\w+)::(\w+)::dds_::(\w+)_")
_HASH = re.compile(r"RIHS01_[0-9a-f]{64}")
_ACTION = "/_action/"
Roles: TypeAlias = tuple[EndpointRole, EndpointRole]
_SERVER: Roles = ("server", "client")
_UNKNOWN = "_NODE_NAME_UNKNOWN_"


@contextmanager
def join_graph(report: Report) -> Iterator[RunningGraph | None]:
    """Yield the graph that this process can see; reports IDL640 where it cannot have a node.

    While it lasts, a hidden node of idlc's own is part of the graph.
    """
    node = None
    try:
        rclpy = import_module("rclpy")
        context = rclpy.Context()
        rclpy.init(args=[], context=context, signal_handler_options=rclpy.SignalHandlerOptions.NO)
        node = rclpy.create_node(
            f"_idlc_{os.getpid()}",
            context=context,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
            parameter_overrides=[rclpy.Parameter("start_type_description_service", value=False)],
        )
    except ImportError as error:
        hint = "source your ROS 2 and use its Python, or run `pip install ros-jazzy-rclpy`"
        report.add(codes.NO_RCLPY.of("graph", f"rclpy is required: {error}", hint=hint))
    except Exception as error:  # rclpy's errors have no common base
        report.add(codes.NO_RCLPY.of("graph", f"rclpy cannot start a node: {error}"))
    if node is None:
        yield None
        return
    try:
        yield RunningGraph(rclpy, node, context)
    finally:
        node.destroy_node()
        context.try_shutdown()


class RunningGraph:
    """The running graph as one node sees it."""

    #: Endpoints of services announce the hashes of the structures that they send and read.
    has_hashes_of_services = False

    def __init__(self, rclpy: Any, node: Any, context: Any) -> None:
        self._rclpy = rclpy
        self._node = node
        self._context = context

    def endpoints(self, patience: float) -> tuple[GraphEndpoint, ...]:
        """Return all ends of topics, services and actions, after `patience` without a change."""
        endpoints = self._now()
        start = rest = time.monotonic()
        while (now := time.monotonic()) - rest < patience and now - start < RESTLESS * patience:
            time.sleep(min(_PAUSE, patience))
            latest = self._now()
            if latest != endpoints:
                endpoints, rest = latest, time.monotonic()
        return endpoints

    def _now(self) -> tuple[GraphEndpoint, ...]:
        endpoints: set[GraphEndpoint] = set()
        roles: Roles
        for name, _ in self._node.get_topic_names_and_types():
            roles = _SERVER if _ACTION in name else ("publisher", "subscription")
            endpoints |= {*self._endpoints(name, name, "topic", roles)}
        # rclpy shows services as topics of DDS only
        for topic, _ in self._node.get_topic_names_and_types(no_demangle=True):
            if match := _SERVICE.fullmatch(topic):
                roles = ("client", "server") if match[1] == "q" else _SERVER
                endpoints |= {*self._endpoints(topic, match[2], "service", roles)}
        return tuple(sorted(endpoints))

    def _endpoints(
        self, topic: str, name: str, entity: Communication, roles: Roles
    ) -> Iterator[GraphEndpoint]:
        """Yield the ends of a topic but idlc's own; the first of `roles` sends, the other reads."""
        node = self._node
        own = f"{node.get_namespace().rstrip('/')}/{node.get_name()}"
        looks = node.get_publishers_info_by_topic, node.get_subscriptions_info_by_topic
        place, is_action, _ = name.partition(_ACTION)
        kind: Communication = "action" if is_action else entity
        for role, look in zip(roles, looks, strict=True):
            for info in look(topic, no_mangle=entity == "service"):
                owner = f"{info.node_namespace.rstrip('/')}/{info.node_name}"
                if owner != own:
                    mangled = _TYPE.fullmatch(info.topic_type)
                    type_ = "/".join(mangled.groups()) if mangled else info.topic_type
                    type_hash = _HASH.fullmatch(str(getattr(info, "topic_type_hash", "")))
                    hash_ = type_hash[0] if type_hash else ""
                    owner = "" if _UNKNOWN in owner else owner
                    yield GraphEndpoint(owner, kind, place, role, role == roles[0], type_, hash_)

    def ask(self, questions: Iterable[TypeQuestion], patience: float) -> dict[TypeQuestion, Answer]:
        """Return the nodes' answers within `patience` seconds; each question has one."""
        questions = list(dict.fromkeys(questions))
        try:
            service = import_module("type_description_interfaces.srv").GetTypeDescription
        except ImportError:
            problem = "this ROS 2 has no type_description_interfaces"
            return dict.fromkeys(questions, Answer(None, problem))
        nodes = dict.fromkeys(question.node for question in questions)
        clients = {node: self._client(service, node) for node in nodes}
        try:
            executor = self._rclpy.executors.SingleThreadedExecutor(context=self._context)
            executor.add_node(self._node)
            calls = _Calls(service, clients, questions)
            end = time.monotonic() + patience
            while (now := time.monotonic()) < end and len(calls.results) < len(questions):
                calls.collect(now)
                calls.start(now)
                executor.spin_once(timeout_sec=_PAUSE)
            executor.remove_node(self._node)
            executor.shutdown()
        finally:
            for client in filter(None, clients.values()):
                self._node.destroy_client(client)
        names = {name for name, _ in self._node.get_service_names_and_types()}
        offered = {node for node in nodes if f"{node}/get_type_description" in names}
        results = calls.results
        return {each: answer_of(results.get(each), each.node in offered) for each in questions}

    def _client(self, service: Any, node: str) -> Any:
        with suppress(Exception):  # a name that no rclpy gives itself
            return self._node.create_client(service, f"{node}/get_type_description")
        return None


def _is_ready(client: Any) -> bool:
    return client is not None and bool(client.service_is_ready())


class _Calls:
    """Calls of the services that answer questions, few of each node at a time."""

    def __init__(
        self, service: Any, clients: Mapping[str, Any], questions: Sequence[TypeQuestion]
    ) -> None:
        self._service = service
        self._clients = clients
        self._questions = questions
        self._open: dict[TypeQuestion, tuple[Any, float]] = {}
        self.results: dict[TypeQuestion, Any] = {}

    def collect(self, now: float) -> None:
        """Take the results that arrived, and give up calls that are open for too long."""
        for question, (future, since) in [*self._open.items()]:
            if future.done():
                self.results[question] = future.result()
            if future.done() or now - since > connect.DROPPED:
                del self._open[question]
                self._clients[question.node].remove_pending_request(future)

    def start(self, now: float) -> None:
        """Call the service for each question that waits, up to the limit of each node."""
        counts = Counter(question.node for question in self._open)
        for question in self._questions:
            node, name, hash_ = question
            is_due = question not in self.results and question not in self._open
            client = self._clients[node]
            if is_due and counts[node] < connect.MOST_OPEN and _is_ready(client):
                request = self._service.Request(
                    type_name=name, type_hash=hash_, include_type_sources=True
                )
                self._open[question] = client.call_async(request), now
                counts[node] += 1


class RobotGraph:
    """The graph that a session sees, in the form in which `idlc breaking` compares graphs."""

    #: Endpoints of services announce the hash of the whole service.
    has_hashes_of_services = True

    def __init__(self, session: Session) -> None:
        self._session = session

    def endpoints(self, patience: float) -> tuple[GraphEndpoint, ...]:
        """Return all ends of topics, services and actions, after waiting for the first one."""
        self._session.graph.wait_for(lambda graph: graph.entities(), patience)
        entities = connect.robot_entities(self._session)
        return tuple(sorted({each for end in entities for each in _robot_endpoints(end)}))

    def ask(self, questions: Iterable[TypeQuestion], patience: float) -> dict[TypeQuestion, Answer]:
        """Return the nodes' answers within `patience` seconds; each question has one."""
        return ask(self._session, questions, patience)


def _robot_endpoints(end: RobotEntity) -> Iterator[GraphEndpoint]:
    noun, name, _ = connect.place_of(end)
    sends = end.kind in (EntityKind.PUBLISHER, EntityKind.CLIENT)
    role: EndpointRole = (
        "server" if end.kind in (EntityKind.PUBLISHER, EntityKind.SERVICE) else "client"
    )
    if noun == "topic":
        role = "publisher" if sends else "subscription"
    if end.kind in connect.TOPICS:
        yield GraphEndpoint(end.node_name, noun, name, role, sends, end.type, end.hash)
    elif end.kind is not EntityKind.NODE:
        for suffix, direction in (("_Request", sends), ("_Response", not sends)):
            structure = f"{end.type}{suffix}"
            yield GraphEndpoint(end.node_name, noun, name, role, direction, structure, end.hash)


#: A structure's full name and type hash.
Key = tuple[str, str]
_HASHES = "nodes announce type hashes from Iron on"
_HASHES_OF_A_ROBOT = (
    f"{_HASHES}, but over DDS not those of services: to compare services, use `--against graph` on "
    "a machine with rclpy"
)
#: The variables that choose a graph.
_OF_A_ROBOT = "ROS_DOMAIN_ID to the nodes' value"
_OF_RCLPY = (
    "ROS_DOMAIN_ID, ROS_AUTOMATIC_DISCOVERY_RANGE and RMW_IMPLEMENTATION to the nodes' values"
)
_NO_NODE = "no node has the interface's description"
_SERVICE_EVENTS = (
    "a node describes a service only to nodes with the same version; to see the difference, add "
    "its files with -I, or turn on service introspection"
)


class GraphVerdict(NamedTuple):
    """The result: the number of findings by broken level, and of compared items by kind.

    `seen` counts nodes, topics, services and actions, `silent` endpoints without a type hash,
    `hidden` findings that break only other levels than the selected ones. `not_compared` are types.
    """

    levels: dict[str, int]
    allowed: int
    seen: dict[str, int]
    silent: int
    endpoints: tuple[GraphEndpoint, ...]
    hidden: int
    not_compared: tuple[str, ...]


def compare_with_graph(
    options: BreakingOptions, patience: float, report: Report, *, has_paths: bool
) -> GraphVerdict:
    """Report types in which endpoints, or local files, differ; ReportedError for an empty graph.

    `patience`: seconds without a change; without files, the installed types are compared. The graph
    is that of this machine's rclpy, or of a robot whose address is compared against.
    """
    scope = options.scope
    listing = list_files(options.paths, scope.root, report, scope.exclude)
    if has_paths:
        report.extend(no_interfaces(path, scope.root, scope.exclude) for path in listing.empty)
    packages = inputs.packages(listing.files, scope, report)
    local_models = error_free_models(packages, scope, report).values()
    report.raise_errors()
    is_robot = is_address(options.against)
    joined = (
        connect.connected(options.against, report, patience) if is_robot else join_graph(report)
    )
    with joined as view:
        graph = RobotGraph(view) if isinstance(view, Session) else view
        if graph is None:
            raise ReportedError
        endpoints = graph.endpoints(patience)
        if not endpoints:
            variables = _OF_A_ROBOT if is_robot else _OF_RCLPY
            message = f"no node appeared within {patience:g} seconds"
            hint = f"set {variables}, or raise --timeout"
            raise report.refused(codes.EMPTY_GRAPH.of(options.against, message, hint=hint))
        whole = graph.has_hashes_of_services
        models, local = _local_versions(local_models, endpoints, scope, whole)
        versions = list(several_versions(endpoints, local))
        questions = dict(_questions(versions, endpoints, models, whole))
        answers = graph.ask(chain.from_iterable(questions.values()), patience)
    with stage("compare", "graph"):
        problems = _add_described(questions, answers, models, whole)
        seen: Reported = set()
        changes = list(several_types(endpoints))
        for several in versions:
            changes += version_changes(several, models, problems, seen)
    files = {name for name, version in local.items() if version.in_files}
    meant = [each for each in endpoints if not has_paths or each.structure in files]
    silent = [endpoint for endpoint in meant if not endpoint.hash]
    if not changes and len(silent) == len(meant):
        reason = "no node announces the hash of one of these types"
        report_nothing(options, reason, _advice(options.against), report)
    names = sorted({str(interface_of(endpoint.structure)) for endpoint in silent})
    skipped = Skipped(tuple(names), "nodes announce no type hash", _advice(options.against))
    left = report_skipped([skipped], options, report)
    judged = judge(changes, options, report)
    facts = len(silent), endpoints, judged.hidden, left
    return GraphVerdict(judged.levels, judged.allowed, _counts(endpoints), *facts)


def _advice(against: str) -> str:
    """Return what to do about endpoints without a type hash."""
    return _HASHES_OF_A_ROBOT if is_address(against) else _HASHES


def _counts(endpoints: Iterable[GraphEndpoint]) -> dict[str, int]:
    """Return the number of nodes, topics, services and actions."""
    named: set[tuple[str, str]] = set()
    for endpoint in endpoints:
        named.add((endpoint.entity, endpoint.name))
        if endpoint.node:
            named.add(("node", endpoint.node))
    numbers = Counter(kind for kind, _ in named)
    return {kind: numbers[kind] for kind in ("node", *get_args(Communication))}


def _local_versions(
    local_models: Iterable[Model], endpoints: Iterable[GraphEndpoint], scope: Scope, whole: bool
) -> tuple[dict[Key, Model], dict[str, LocalType]]:
    """Return all versions of types on this machine, and the one in use of each type."""
    models: dict[Key, Model] = {}
    local: dict[str, LocalType] = {}
    for model in local_models:
        local |= {name: LocalType(hash_, True) for name, hash_ in _add(model, models, whole)}
    for model in _installed((endpoint.structure for endpoint in endpoints), scope):
        for name, hash_ in _add(model, models, whole):
            local.setdefault(name, LocalType(hash_, False))
    return models, local


def _add(model: Model, models: dict[Key, Model], whole: bool) -> Iterator[Key]:
    """Add the structures of a model to `models`; yield their names and hashes.

    With `whole`, requests and responses get the hash of their whole service.
    """
    for name in map(str, model.messages):
        key = (name, model.describer.hash((whole and service_of(name)) or name))
        models.setdefault(key, model)
        yield key


def _installed(names: Iterable[str], scope: Scope) -> Iterator[Model]:
    """Yield the models of interfaces that are installed, or found along -I, without broken ones."""
    dropped = Report()
    library = Library(scope.include, scope.root, dropped, distro=scope.distro)
    compiler = Compiler(library)
    for name in sorted(set(map(interface_of, names))):
        try:
            interface = ir.TypeName.parse(name)
        except ValueError:
            continue
        source = library.source(interface) if library.path(interface) else None
        if source is not None:
            problems = Report()
            own = compiler.add([(interface, source)], problems)
            model = compiler.model(interface.package, own, problems)
            if not problems.had_errors and not any(oversized(model)):
                yield model


def _questions(
    versions: Iterable[Sequence[TypeVersion]],
    endpoints: Iterable[GraphEndpoint],
    models: Mapping[Key, Model],
    whole: bool,
) -> Iterator[tuple[Key, list[TypeQuestion]]]:
    """Yield the questions about each version without a model.

    A node knows a service by the hash of the whole, which only service introspection announces:
    the description of its events holds request and response.
    """
    events: dict[str, list[GraphEndpoint]] = {}
    for endpoint in endpoints:
        if endpoint.structure.endswith("_Event") and endpoint.hash:
            events.setdefault(endpoint.structure, []).append(endpoint)
    for version in chain.from_iterable(versions):
        nodes = version.nodes
        if version.key not in models:
            type_ = (whole and service_of(version.type)) or version.type
            questions = [TypeQuestion(node, type_, version.hash) for node in nodes[:ASKED]]
            if not whole and (event := event_of(version.type)):
                ends = [end for end in events.get(event, ()) if end.node in nodes]
                questions = [TypeQuestion(end.node, event, end.hash) for end in ends]
            yield version.key, questions


def _add_described(
    questions: Mapping[Key, Sequence[TypeQuestion]],
    answers: Mapping[TypeQuestion, Answer],
    models: dict[Key, Model],
    whole: bool,
) -> dict[Key, str]:
    """Add the described types to `models`; return the problems of the others."""
    problems: dict[Key, list[str]] = {}
    no_events = _NO_NODE if whole else _SERVICE_EVENTS
    for key, sent in questions.items():
        for question in sent:
            node, name, type_hash = question
            description, problem, sources = answers[question]
            if description is not None:
                try:
                    model = reported_model(description, sources, name, type_hash, node)
                    if any(oversized(model)):
                        raise DescriptionError("it is too large")
                    list(_add(model, models, whole))
                except DescriptionError as error:
                    problem = f"is not plausible: {error}"
            if problem:
                problems.setdefault(key, []).append(f"`{node}` {problem}")
    return {
        key: first_few(problems.get(key, [no_events if event_of(key[0]) else _NO_NODE]), 3)
        for key in questions
        if key not in models
    }
