"""The running ROS 2 graph, through rclpy: who sends and reads what, and how nodes describe types.

Which graph it is, the user's environment says (ROS_DOMAIN_ID and the middleware's variables).
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
from typing import TYPE_CHECKING, Any, NamedTuple, get_args

from idlc.check.compiler import Compiler, models_of, stage
from idlc.compare import graph
from idlc.compare.breaking import BreakingOptions, not_allowed
from idlc.compare.changes import LEVELS, Change
from idlc.compare.graph import (
    Endpoint,
    Entity,
    Here,
    Role,
    Version,
    event_of,
    interface_of,
    several_types,
    several_versions,
)
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report, first_few
from idlc.diagnostics.text import one_line
from idlc.model import ir
from idlc.model.from_description import NotBelievedError, reported_model
from idlc.model.link import Model
from idlc.project import inputs
from idlc.project.find import look, nothing_in
from idlc.project.library import Library
from idlc.project.settings import Scope
from idlc.wire.layout import oversized

if TYPE_CHECKING:
    from idlc.model.describe import DescriptionDict, IndividualDict

#: How much longer than without news a graph that never rests is watched.
RESTLESS = 10
#: Nodes that are asked about one version.
ASKED = 8
_PAUSE = 0.1
#: What DDS calls a request's or a reply's topic, and a structure.
_SERVICE = re.compile(r"r([qr])(/.+)(?:Request|Reply)")
_TYPE = re.compile(r"(\w+)::(\w+)::dds_::(\w+)_")
_HASH = re.compile(r"RIHS01_[0-9a-f]{64}")
_UNKNOWN = "_NODE_NAME_UNKNOWN_"


class Question(NamedTuple):
    """What a node is asked for: a type that it uses, by name and hash."""

    node: str
    type: str
    hash: str


class Answer(NamedTuple):
    """A node's description of a type, or why there is none; `sources` are .msg files by type."""

    description: DescriptionDict | None
    problem: str = ""
    sources: Mapping[str, str] = MappingProxyType({})


@contextmanager
def joined(report: Report) -> Iterator[Graph | None]:
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
            parameter_overrides=[
                rclpy.Parameter("start_type_description_service", value=False),
            ],
        )
    except ImportError as error:
        hint = "source your ROS 2 and use its Python, or pip install ros-jazzy-rclpy"
        report.add(codes.NO_RCLPY.of("graph", f"this needs rclpy: {error}", hint=hint))
    except Exception as error:  # rclpy has no common base for what goes wrong here
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
    """What a node can see of all others."""

    def __init__(self, rclpy: Any, node: Any, context: Any) -> None:
        self._rclpy = rclpy
        self._node = node
        self._context = context

    def endpoints(self, patience: float) -> tuple[Endpoint, ...]:
        """Return all ends of topics, services and actions, once nothing changed for a time."""
        found = self._now()
        start = rest = time.monotonic()
        while (now := time.monotonic()) - rest < patience and now - start < RESTLESS * patience:
            time.sleep(min(_PAUSE, patience))
            latest = self._now()
            if latest != found:
                found, rest = latest, time.monotonic()
        return found

    def _now(self) -> tuple[Endpoint, ...]:
        return tuple(sorted({*self._topics(), *self._services()}))

    def _topics(self) -> Iterator[Endpoint]:
        for name, _ in self._node.get_topic_names_and_types():
            owner, is_action, _ = name.partition("/_action/")
            entity: Entity = "action" if is_action else "topic"
            for sends in (True, False):
                role: Role = "publisher" if sends else "subscription"
                if is_action:
                    role = "server" if sends else "client"
                for node, type_, hash_ in self._ends(name, sends):
                    yield Endpoint(node, entity, owner, role, sends, type_, hash_)

    def _services(self) -> Iterator[Endpoint]:
        """Yield the ends of services, which rclpy shows as topics of DDS only."""
        for topic, _ in self._node.get_topic_names_and_types(no_demangle=True):
            found = _SERVICE.fullmatch(topic)
            if found is None:
                continue
            owner, is_action, _ = found[2].partition("/_action/")
            entity: Entity = "action" if is_action else "service"
            for sends in (True, False):
                role: Role = "client" if sends == (found[1] == "q") else "server"
                for node, type_, hash_ in self._ends(topic, sends, no_mangle=True):
                    yield Endpoint(node, entity, owner, role, sends, type_, hash_)

    def _ends(
        self, topic: str, sends: bool, *, no_mangle: bool = False
    ) -> Iterator[tuple[str, str, str]]:
        """Yield node, type and hash of each end of a topic but for idlc's own."""
        node = self._node
        look = node.get_publishers_info_by_topic if sends else node.get_subscriptions_info_by_topic
        own = f"{node.get_namespace().rstrip('/')}/{node.get_name()}"
        for info in look(topic, no_mangle=no_mangle):
            who = f"{info.node_namespace.rstrip('/')}/{info.node_name}"
            if who != own:
                mangled = _TYPE.fullmatch(info.topic_type)
                type_ = "/".join(mangled.groups()) if mangled else info.topic_type
                told = _HASH.fullmatch(str(getattr(info, "topic_type_hash", "")))
                known = _UNKNOWN not in who
                yield who if known else "", type_, told[0] if told else ""

    def ask(self, questions: Iterable[Question], patience: float) -> dict[Question, Answer]:
        """Return what nodes answer within a time; each question has an answer."""
        questions = list(dict.fromkeys(questions))
        try:
            service = import_module("type_description_interfaces.srv").GetTypeDescription
        except ImportError:
            problem = "this ROS 2 has no type_description_interfaces"
            return dict.fromkeys(questions, Answer(None, problem))
        nodes = dict.fromkeys(one.node for one in questions)
        clients = {node: self._client(service, node) for node in nodes}
        try:
            futures = self._answers(service, clients, questions, patience)
        finally:
            for client in filter(None, clients.values()):
                self._node.destroy_client(client)
        offered = {name for name, _ in self._node.get_service_names_and_types()}
        return {
            one: _answer(futures.get(one), f"{one.node}/get_type_description" in offered)
            for one in questions
        }

    def _client(self, service: Any, node: str) -> Any:
        with suppress(Exception):  # a name that no rclpy gives itself
            return self._node.create_client(service, f"{node}/get_type_description")
        return None

    def _answers(
        self,
        service: Any,
        clients: Mapping[str, Any],
        questions: Sequence[Question],
        patience: float,
    ) -> dict[Question, Any]:
        """Return the results of the questions that could be asked, and were answered in time."""
        executor = self._rclpy.executors.SingleThreadedExecutor(context=self._context)
        executor.add_node(self._node)
        futures: dict[Question, Any] = {}
        end = time.monotonic() + patience
        while time.monotonic() < end:
            for one in questions:
                client = clients[one.node]
                if one not in futures and client is not None and client.service_is_ready():
                    request = service.Request(
                        type_name=one.type, type_hash=one.hash, include_type_sources=True
                    )
                    futures[one] = client.call_async(request)
            if len(futures) == len(questions) and all(one.done() for one in futures.values()):
                break
            executor.spin_once(timeout_sec=_PAUSE)
        executor.remove_node(self._node)
        executor.shutdown()
        return {one: future.result() for one, future in futures.items() if future.done()}


def _answer(result: Any, is_offered: bool) -> Answer:
    if result is None and not is_offered:
        return Answer(None, "has no ~/get_type_description")
    if result is None:
        return Answer(None, "does not answer")
    if not result.successful:
        return Answer(None, f"says: {one_line(result.failure_reason)}")
    told = result.type_description
    return Answer(
        {
            "type_description": _individual(told.type_description),
            "referenced_type_descriptions": [
                _individual(one) for one in told.referenced_type_descriptions
            ],
        },
        sources={
            one.type_name: one.raw_file_contents
            for one in result.type_sources
            if one.encoding == "msg"
        },
    )


def _individual(told: Any) -> IndividualDict:
    return {
        "type_name": told.type_name,
        "fields": [
            {
                "name": field.name,
                "type": {
                    "type_id": field.type.type_id,
                    "capacity": field.type.capacity,
                    "string_capacity": field.type.string_capacity,
                    "nested_type_name": field.type.nested_type_name,
                },
                "default_value": field.default_value,
            }
            for field in told.fields
        ],
    }


#: A structure's full name and type hash.
Key = tuple[str, str]
_NO_NODE = "there is no node that could be asked"
_SERVICE_EVENTS = (
    "a node describes a service only to those who have the same one; to see what differs, give "
    "its files with -I, or turn on service introspection"
)


class GraphVerdict(NamedTuple):
    """What came out: how many findings break each level, and all that was looked at.

    `seen` is how many nodes, topics, services and actions that is; `silent` how many endpoints
    tell no type hash; `hidden` how many findings break other levels than those asked for.
    """

    levels: dict[str, int]
    allowed: int
    seen: dict[str, int]
    silent: int
    endpoints: tuple[Endpoint, ...]
    hidden: int


def compare_with_graph(
    options: BreakingOptions, patience: float, report: Report, *, is_given: bool
) -> GraphVerdict | None:
    """Report where endpoints, or the files here, differ in a type; `None` if nothing was seen.

    `patience` is how many seconds may pass without news; without files, what is installed counts.
    """
    given = _given(options, report, is_given=is_given)
    if report.had_errors:
        return None
    with joined(report) as graph:
        endpoints = graph.endpoints(patience) if graph else ()
        if graph is None or not endpoints:
            report.extend([_empty(patience)] if graph else [])
            return None
        known, here = _here(given, endpoints, options.scope)
        found = list(several_versions(endpoints, here))
        questions = dict(_questions(found, endpoints, known))
        answers = graph.ask(chain.from_iterable(questions.values()), patience)
    with stage("compare", "graph"):
        problems = _learn(questions, answers, known)
        changes = [*several_types(endpoints), *_changes(found, known, problems)]
    left = not_allowed(changes, options, report)
    wanted = [change for change in left if change.levels & set(options.levels)]
    report.extend(change.diagnostic for change in wanted)
    return GraphVerdict(
        {level: sum(level in change.levels for change in wanted) for level in LEVELS},
        len(changes) - len(left),
        _counts(endpoints),
        sum(not one.hash for one in endpoints),
        endpoints,
        len(left) - len(wanted),
    )


def _counts(endpoints: Iterable[Endpoint]) -> dict[str, int]:
    nodes = {one.node for one in endpoints if one.node}
    entities = Counter(entity for entity, _ in {(one.entity, one.name) for one in endpoints})
    return {"node": len(nodes)} | {one: entities[one] for one in get_args(Entity)}


def _empty(patience: float) -> Diagnostic:
    return codes.EMPTY_GRAPH.of(
        "graph",
        f"no node was found within {patience:g} seconds",
        hint="compare ROS_DOMAIN_ID, ROS_AUTOMATIC_DISCOVERY_RANGE and RMW_IMPLEMENTATION with "
        "those of the nodes, or give it more time with --timeout",
    )


def _given(options: BreakingOptions, report: Report, *, is_given: bool) -> list[Model]:
    """Return the models of the files that were given, or that are found here."""
    there = look(options.paths, options.scope.root, report, options.scope.exclude)
    if is_given:
        report.extend(
            nothing_in(one, options.scope.root, options.scope.exclude) for one in there.empty
        )
    packages = inputs.packages(there.files, options.scope, report)
    found = Report()
    models = [model for _, model in models_of(packages, options.scope, found)]
    if not found.had_errors:
        found.extend(chain.from_iterable(map(oversized, models)))
    report.extend(one for one in found if one.severity is codes.ERROR)
    return models


def _here(
    given: Iterable[Model], endpoints: Iterable[Endpoint], scope: Scope
) -> tuple[dict[Key, Model], dict[str, Here]]:
    """Return all versions that this machine has, and which one it uses of each type."""
    known: dict[Key, Model] = {}
    here: dict[str, Here] = {}
    for model in given:
        here |= {name: Here(hash_, True) for name, hash_ in _add(model, known)}
    for model in _installed({one.structure for one in endpoints}, scope):
        for name, hash_ in _add(model, known):
            here.setdefault(name, Here(hash_, False))
    return known, here


def _add(model: Model, known: dict[Key, Model]) -> Iterator[Key]:
    """Add the structures of a model to what is known; yield their names and hashes."""
    for name in map(str, model.messages):
        key = (name, model.describer.hash(name))
        known.setdefault(key, model)
        yield key


def _installed(names: Iterable[str], scope: Scope) -> Iterator[Model]:
    """Yield the models of interfaces that are installed, or found along -I; broken ones are not."""
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
            found = Report()
            own = compiler.add([(interface, source)], found)
            model = compiler.model(interface.package, own, found)
            if not found.had_errors and not any(oversized(model)):
                yield model


def _questions(
    found: Iterable[Sequence[Version]], endpoints: Iterable[Endpoint], known: Mapping[Key, Model]
) -> Iterator[tuple[Key, list[Question]]]:
    """Yield what to ask about each version that is not known.

    A node knows a service by the hash of the whole, which only service introspection tells: the
    description of its events holds request and response.
    """
    events = [one for one in endpoints if one.structure.endswith("_Event") and one.hash]
    for version in chain.from_iterable(found):
        key = (version.type, version.hash)
        if key not in known:
            wanted = [Question(node, *key) for node in version.nodes[:ASKED]]
            if event := event_of(version.type):
                mine = (
                    one for one in events if one.structure == event and one.node in version.nodes
                )
                wanted = [Question(one.node, one.structure, one.hash) for one in mine]
            yield key, wanted


def _learn(
    questions: Mapping[Key, Sequence[Question]],
    answers: Mapping[Question, Answer],
    known: dict[Key, Model],
) -> dict[Key, str]:
    """Add what nodes described to what is known; return why the others are not."""
    problems: dict[Key, list[str]] = {}
    for key, asked in questions.items():
        for question in asked:
            node, name, type_hash = question
            description, problem, sources = answers[question]
            if description is not None:
                try:
                    model = reported_model(description, sources, name, type_hash, node)
                    if any(oversized(model)):
                        raise NotBelievedError("it is larger than anybody can use")
                except NotBelievedError as error:
                    problem = f"is not believed: {error}"
                else:
                    list(_add(model, known))
            if problem:
                problems.setdefault(key, []).append(f"`{node}` {problem}")
    return {
        key: first_few(problems.get(key, [_SERVICE_EVENTS if event_of(key[0]) else _NO_NODE]), 3)
        for key in questions
        if key not in known
    }


def _changes(
    found: Iterable[Sequence[Version]], known: Mapping[Key, Model], problems: Mapping[Key, str]
) -> Iterator[Change]:
    seen: graph.Seen = set()
    for versions in found:
        yield from graph.version_changes(versions, known, problems, seen)
