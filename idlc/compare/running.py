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
from types import MappingProxyType
from typing import Any, NamedTuple, TypeAlias, get_args

from idlc.check.compiler import Compiler, stage
from idlc.compare.breaking import BreakingOptions, error_free_models, judge
from idlc.compare.graph import (
    Endpoint,
    Entity,
    LocalType,
    Reported,
    Role,
    Version,
    event_of,
    interface_of,
    several_types,
    several_versions,
    version_changes,
)
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, first_few
from idlc.diagnostics.text import one_line
from idlc.model import ir
from idlc.model.describe import DescriptionDict
from idlc.model.from_description import DescriptionError, reported_model
from idlc.model.link import Model
from idlc.project import inputs
from idlc.project.find import list_files, no_interfaces
from idlc.project.library import Library
from idlc.project.settings import Scope
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
Roles: TypeAlias = tuple[Role, Role]
_SERVER: Roles = ("server", "client")
_UNKNOWN = "_NODE_NAME_UNKNOWN_"


class Question(NamedTuple):
    """A request to a node to describe a type that it uses, by name and hash."""

    node: str
    type: str
    hash: str


class Answer(NamedTuple):
    """A node's description of a type, or the problem with it; `sources` are .msg files by type."""

    description: DescriptionDict | None
    problem: str = ""
    sources: Mapping[str, str] = MappingProxyType({})


@contextmanager
def join_graph(report: Report) -> Iterator[Graph | None]:
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
        hint = "source your ROS 2 and use its Python, or pip install ros-jazzy-rclpy"
        report.add(codes.NO_RCLPY.of("graph", f"this needs rclpy: {error}", hint=hint))
    except Exception as error:  # rclpy's errors have no common base
        report.add(codes.NO_RCLPY.of("graph", f"rclpy cannot start a node: {error}"))
    if node is None:
        yield None
        return
    try:
        yield Graph(rclpy, node, context)
    finally:
        node.destroy_node()
        context.try_shutdown()


class Graph:
    """The running graph as one node sees it."""

    def __init__(self, rclpy: Any, node: Any, context: Any) -> None:
        self._rclpy = rclpy
        self._node = node
        self._context = context

    def endpoints(self, patience: float) -> tuple[Endpoint, ...]:
        """Return all ends of topics, services and actions, after `patience` without a change."""
        endpoints = self._now()
        start = rest = time.monotonic()
        while (now := time.monotonic()) - rest < patience and now - start < RESTLESS * patience:
            time.sleep(min(_PAUSE, patience))
            latest = self._now()
            if latest != endpoints:
                endpoints, rest = latest, time.monotonic()
        return endpoints

    def _now(self) -> tuple[Endpoint, ...]:
        endpoints: set[Endpoint] = set()
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

    def _endpoints(self, topic: str, name: str, entity: Entity, roles: Roles) -> Iterator[Endpoint]:
        """Yield the ends of a topic but idlc's own; the first of `roles` sends, the other reads."""
        node = self._node
        own = f"{node.get_namespace().rstrip('/')}/{node.get_name()}"
        looks = node.get_publishers_info_by_topic, node.get_subscriptions_info_by_topic
        place, is_action, _ = name.partition(_ACTION)
        kind: Entity = "action" if is_action else entity
        for role, look in zip(roles, looks, strict=True):
            for info in look(topic, no_mangle=entity == "service"):
                owner = f"{info.node_namespace.rstrip('/')}/{info.node_name}"
                if owner != own:
                    mangled = _TYPE.fullmatch(info.topic_type)
                    type_ = "/".join(mangled.groups()) if mangled else info.topic_type
                    type_hash = _HASH.fullmatch(str(getattr(info, "topic_type_hash", "")))
                    hash_ = type_hash[0] if type_hash else ""
                    owner = "" if _UNKNOWN in owner else owner
                    yield Endpoint(owner, kind, place, role, role == roles[0], type_, hash_)

    def ask(self, questions: Iterable[Question], patience: float) -> dict[Question, Answer]:
        """Return the nodes' answers within `patience` seconds; each question has one."""
        questions = list(dict.fromkeys(questions))
        try:
            service = import_module("type_description_interfaces.srv").GetTypeDescription
        except ImportError:
            problem = "this ROS 2 has no type_description_interfaces"
            return dict.fromkeys(questions, Answer(None, problem))
        nodes = dict.fromkeys(question.node for question in questions)
        clients = {node: self._client(service, node) for node in nodes}
        futures: dict[Question, Any] = {}
        try:
            executor = self._rclpy.executors.SingleThreadedExecutor(context=self._context)
            executor.add_node(self._node)
            end = time.monotonic() + patience
            while time.monotonic() < end:
                for question in questions:
                    client = clients[question.node]
                    if question not in futures and client is not None and client.service_is_ready():
                        _, name, hash_ = question
                        request = service.Request(
                            type_name=name, type_hash=hash_, include_type_sources=True
                        )
                        futures[question] = client.call_async(request)
                if len(futures) == len(questions) and all(each.done() for each in futures.values()):
                    break
                executor.spin_once(timeout_sec=_PAUSE)
            executor.remove_node(self._node)
            executor.shutdown()
            results = {question: each.result() for question, each in futures.items() if each.done()}
        finally:
            for client in filter(None, clients.values()):
                self._node.destroy_client(client)
        names = {name for name, _ in self._node.get_service_names_and_types()}
        offered = {node for node in nodes if f"{node}/get_type_description" in names}
        return {each: _answer(results.get(each), each.node in offered) for each in questions}

    def _client(self, service: Any, node: str) -> Any:
        with suppress(Exception):  # a name that no rclpy gives itself
            return self._node.create_client(service, f"{node}/get_type_description")
        return None


def _answer(result: Any, is_offered: bool) -> Answer:
    if result is None and not is_offered:
        return Answer(None, "has no ~/get_type_description")
    if result is None:
        return Answer(None, "does not answer")
    if not result.successful:
        return Answer(None, f"says: {one_line(result.failure_reason)}")
    sources = {
        source.type_name: source.raw_file_contents
        for source in result.type_sources
        if source.encoding == "msg"
    }
    return Answer(_plain(result.type_description), sources=sources)


def _plain(value: Any) -> Any:
    """Return a message as dictionaries by field."""
    if isinstance(value, list):
        return [_plain(item) for item in value]
    if not hasattr(value, "get_fields_and_field_types"):
        return value
    return {name: _plain(getattr(value, name)) for name in value.get_fields_and_field_types()}


#: A structure's full name and type hash.
Key = tuple[str, str]
_NO_NODE = "there is no node that could be asked"
_SERVICE_EVENTS = (
    "a node describes a service only to those who have the same one; to see what differs, give "
    "its files with -I, or turn on service introspection"
)


class GraphVerdict(NamedTuple):
    """The result: the number of findings by broken level, and of compared items by kind.

    `seen` counts nodes, topics, services and actions, `silent` endpoints without a type hash,
    `hidden` findings that break only other levels than the selected ones.
    """

    levels: dict[str, int]
    allowed: int
    seen: dict[str, int]
    silent: int
    endpoints: tuple[Endpoint, ...]
    hidden: int


def compare_with_graph(
    options: BreakingOptions, patience: float, report: Report, *, has_paths: bool
) -> GraphVerdict | None:
    """Report types in which endpoints, or local files, differ; `None` for an empty graph.

    `patience`: seconds without a change; without files, the installed types are compared.
    """
    scope = options.scope
    listing = list_files(options.paths, scope.root, report, scope.exclude)
    if has_paths:
        report.extend(no_interfaces(path, scope.root, scope.exclude) for path in listing.empty)
    packages = inputs.packages(listing.files, scope, report)
    local_models = error_free_models(packages, scope, report).values()
    if report.had_errors:
        return None
    with join_graph(report) as graph:
        endpoints = graph.endpoints(patience) if graph else ()
        if graph is None or not endpoints:
            hint = (
                "compare ROS_DOMAIN_ID, ROS_AUTOMATIC_DISCOVERY_RANGE and RMW_IMPLEMENTATION with "
                "those of the nodes, or give it more time with --timeout"
            )
            message = f"no node was found within {patience:g} seconds"
            report.extend([codes.EMPTY_GRAPH.of("graph", message, hint=hint)] if graph else [])
            return None
        models, local = _local_versions(local_models, endpoints, scope)
        versions = list(several_versions(endpoints, local))
        questions = dict(_questions(versions, endpoints, models))
        answers = graph.ask(chain.from_iterable(questions.values()), patience)
    with stage("compare", "graph"):
        problems = _add_described(questions, answers, models)
        seen: Reported = set()
        changes = list(several_types(endpoints))
        for several in versions:
            changes += version_changes(several, models, problems, seen)
    judged = judge(changes, options, report)
    silent = sum(not endpoint.hash for endpoint in endpoints)
    named: set[tuple[str, str]] = {(endpoint.entity, endpoint.name) for endpoint in endpoints}
    named |= {("node", endpoint.node) for endpoint in endpoints if endpoint.node}
    numbers = Counter(kind for kind, _ in named)
    counts = {kind: numbers[kind] for kind in ("node", *get_args(Entity))}
    return GraphVerdict(judged.levels, judged.allowed, counts, silent, endpoints, judged.hidden)


def _local_versions(
    local_models: Iterable[Model], endpoints: Iterable[Endpoint], scope: Scope
) -> tuple[dict[Key, Model], dict[str, LocalType]]:
    """Return all versions of types on this machine, and the one in use of each type."""
    models: dict[Key, Model] = {}
    local: dict[str, LocalType] = {}
    for model in local_models:
        local |= {name: LocalType(hash_, True) for name, hash_ in _add(model, models)}
    for model in _installed((endpoint.structure for endpoint in endpoints), scope):
        for name, hash_ in _add(model, models):
            local.setdefault(name, LocalType(hash_, False))
    return models, local


def _add(model: Model, models: dict[Key, Model]) -> Iterator[Key]:
    """Add the structures of a model to `models`; yield their names and hashes."""
    for name in map(str, model.messages):
        key = (name, model.describer.hash(name))
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
    versions: Iterable[Sequence[Version]],
    endpoints: Iterable[Endpoint],
    models: Mapping[Key, Model],
) -> Iterator[tuple[Key, list[Question]]]:
    """Yield the questions about each version without a model.

    A node knows a service by the hash of the whole, which only service introspection announces:
    the description of its events holds request and response.
    """
    events: dict[str, list[Endpoint]] = {}
    for endpoint in endpoints:
        if endpoint.structure.endswith("_Event") and endpoint.hash:
            events.setdefault(endpoint.structure, []).append(endpoint)
    for version in chain.from_iterable(versions):
        nodes = version.nodes
        if version.key not in models:
            questions = [Question(node, *version.key) for node in nodes[:ASKED]]
            if event := event_of(version.type):
                ends = [end for end in events.get(event, ()) if end.node in nodes]
                questions = [Question(end.node, event, end.hash) for end in ends]
            yield version.key, questions


def _add_described(
    questions: Mapping[Key, Sequence[Question]],
    answers: Mapping[Question, Answer],
    models: dict[Key, Model],
) -> dict[Key, str]:
    """Add the described types to `models`; return the problems of the others."""
    problems: dict[Key, list[str]] = {}
    for key, sent in questions.items():
        for question in sent:
            node, name, type_hash = question
            description, problem, sources = answers[question]
            if description is not None:
                try:
                    model = reported_model(description, sources, name, type_hash, node)
                    if any(oversized(model)):
                        raise DescriptionError("it is larger than anybody can use")
                    list(_add(model, models))
                except DescriptionError as error:
                    problem = f"is not believed: {error}"
            if problem:
                problems.setdefault(key, []).append(f"`{node}` {problem}")
    return {
        key: first_few(problems.get(key, [_SERVICE_EVENTS if event_of(key[0]) else _NO_NODE]), 3)
        for key in questions
        if key not in models
    }
