"""The types that a robot uses, as the topics of a recording.

Nodes send definitions of their types on request. A definition is accepted only if it has the hash
that the endpoint announces. Types that are known locally with that hash are not requested.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from threading import BoundedSemaphore
from typing import Any, NamedTuple

from idlc.check.compiler import Compiler
from idlc.compare.graph import Answer, Question, answer_of
from idlc.diagnostics.report import Report, first_few
from idlc.diagnostics.source import Source
from idlc.documents.schemas import mcap
from idlc.language.parse import parse
from idlc.model import catalog, ir
from idlc.model.distros import NEWEST
from idlc.model.from_description import DescriptionError, model_of_description
from idlc.model.link import Model, link
from idlc.model.lower import lower
from idlc.project.library import Library
from idlc.project.root import Root
from idlc.project.settings import Scope
from idlc.recordings.containers.file import CDR, MSG, Schema, Topic
from idlc.recordings.definitions import (
    RecordedDefinition,
    TextCache,
    interface_of,
    read_definition,
    type_name,
)
from idlc.recordings.memory import class_in, home_of
from idlc.robot.keys import Entity, Kind, pack_attachment
from idlc.robot.live.connect import connected, now, own_endpoint, robot_entities
from idlc.robot.names import action_part
from idlc.robot.qos import QoSProfile
from idlc.robot.session import Session
from idlc.robot.transport import Sample

#: Seconds that idlc waits for all replies of a robot.
PATIENCE = 5.0
#: Nodes that are asked about one type, and requests at a time.
ASKED = 3
AT_ONCE = 32
#: Bytes of one reply, and of all replies together.
MOST_REPLY = 4 << 20
MOST_REPLIES = 64 << 20
#: Characters of a definition with all that it refers to.
MOST_TEXT = 1 << 20
DESCRIBE = "type_description_interfaces/srv/GetTypeDescription"
_SERVICE = "/get_type_description"
#: The suffixes of the structures that a file of each kind consists of.
_SECTIONS: dict[ir.Kind, tuple[str, ...]] = {
    "msg": ("",),
    "srv": ("_Request", "_Response"),
    "action": ("_Goal", "_Result", "_Feedback"),
}
_FEEDBACK = "feedback"


@cache
def _describe_class() -> Any:
    name = ir.TypeName.parse(DESCRIBE)
    source = catalog.source(name)
    own = lower(parse(source), name, Report()) if source else None
    model = link(name.package, [own] if own else [], catalog, Report())
    models = {p: _of_package(model, p) for p in {each.package for each in model.interfaces}}
    return class_in(home_of(models), name)


def _of_package(model: Model, package: str) -> Model:
    own = tuple(each for name, each in model.interfaces.items() if name.package == package)
    return Model(package, own, model.interfaces)


def ask(
    session: Session, questions: Iterable[Question], patience: float = PATIENCE
) -> dict[Question, Answer]:
    """Return the nodes' answers within `patience` seconds; each question has one."""
    questions = list(dict.fromkeys(questions))
    services = {
        end.name.removesuffix(_SERVICE): end
        for end in robot_entities(session, Kind.SERVICE)
        if end.type == DESCRIBE and end.name.endswith(_SERVICE)
    }
    replies: dict[Question, bytes] = {}
    room = [MOST_REPLIES]
    slots = BoundedSemaphore(AT_ONCE)
    end = time.monotonic() + patience

    def left() -> float:
        return max(0.0, end - time.monotonic())

    def send(number: int, question: Question, service: Entity) -> None:
        def receive(sample: Sample | None) -> None:
            if sample is None:
                slots.release()
            elif question not in replies and len(sample.payload) <= min(MOST_REPLY, room[0]):
                replies[question] = sample.payload
                room[0] -= len(sample.payload)

        request = _describe_class().Request(
            type_name=question.type, type_hash=question.hash, include_type_sources=True
        )
        client = own_endpoint(session, service, Kind.CLIENT, QoSProfile())
        attachment = pack_attachment(number, now(), client.gid)
        payload = request.serialize()
        timeout = max(left(), 0.1)
        session.transport.call(service.key, payload, attachment, receive, timeout=timeout)

    for number, question in enumerate(questions, 1):
        if service := services.get(question.node):
            if not slots.acquire(timeout=left()):
                break
            send(number, question, service)
    for _ in range(AT_ONCE):
        slots.acquire(timeout=left())
    received = dict(replies)
    return {each: _answer(received.get(each), each.node in services) for each in questions}


def _answer(payload: bytes | None, is_offered: bool) -> Answer:
    try:
        result = payload and _describe_class().Response.deserialize(payload)
    except ValueError:
        return Answer(None, "sends a malformed reply")
    return answer_of(result or None, is_offered)


class UsedType(NamedTuple):
    """A type with its hash, and the endpoints that use it.

    An action's is that of its feedback; the endpoints include those of its other parts.
    """

    name: ir.TypeName
    hash: str
    endpoints: tuple[Entity, ...]

    @property
    def interface(self) -> ir.TypeName:
        """The interface that defines the type."""
        return interface_of(self.name)


def robot_topics(session: Session, address: str) -> tuple[RecordedDefinition, ...]:
    """Return topics, services and actions of a robot, with verified definitions."""
    return definitions(session, address, robot_entities(session, *list(Kind)[1:]))


def read_robot(address: str, report: Report) -> tuple[RecordedDefinition, ...] | None:
    """Return the same of the robot with this address; `None` after an error, which is reported."""
    with connected(address, report) as session:
        return robot_topics(session, address) if session else None


def definitions(
    session: Session,
    address: str,
    entities: Iterable[Entity],
    *,
    whole: bool = False,
    patience: float = PATIENCE,
) -> tuple[RecordedDefinition, ...]:
    """Return the definitions of what endpoints use, one for each name and version of its type.

    `address` is the robot's name in reports. Local types with the right hash have no definition
    of the robot's, unless `whole` asks for their own.
    """
    entities = list(entities)
    parts = (action_part(end.name) for end in entities)
    whole_actions = {part[0] for part in parts if part and part[1] == _FEEDBACK}
    places: dict[tuple[str, str, str], list[Entity]] = {}
    actions: dict[tuple[str, str], list[Entity]] = {}
    for end in entities:
        part = action_part(end.name)
        name = type_name(end.type)
        if part and name and part[1] not in ("cancel_goal", "status"):
            actions.setdefault((part[0], str(interface_of(name))), []).append(end)
        is_action = part is not None and part[0] in whole_actions
        if part is None or not is_action or part[1] == _FEEDBACK:
            place = part[0] if part and is_action else end.name
            places.setdefault((place, end.type, end.hash), []).append(end)
    types: dict[tuple[str, str], list[Entity]] = {}
    for (place, type_, hash_), ends in places.items():
        name = type_name(type_)
        others = actions.get((place, str(name and interface_of(name))), []) if name else []
        types.setdefault((type_, hash_), []).extend(dict.fromkeys((*ends, *others)))
    used = [
        UsedType(name, hash_, tuple(ends))
        for (type_, hash_), ends in types.items()
        if (name := type_name(type_))
    ]
    schemas, problems = _schemas(session, used, whole, patience)
    cache: TextCache = {}
    topics = []
    for place, type_, hash_ in places:
        schema = schemas.get((type_, hash_))
        topic = Topic(place, type_, 0, hash_ or None, CDR, schema)
        read = read_definition(topic, address, cache)
        problem = problems.get((type_, hash_), "")
        topics.append(read._replace(origin="the robot", problem=problem))
    return tuple(topics)


Key = tuple[str, str]


def _schemas(
    session: Session, used: Sequence[UsedType], whole: bool, patience: float
) -> tuple[dict[Key, Schema], dict[Key, str]]:
    """Return definitions by type and hash, and the reasons why others are missing."""
    local = _Local()
    schemas: dict[Key, Schema] = {}
    problems: dict[Key, str] = {}
    unknown: dict[Key, list[Question]] = {}
    for each in used:
        key = str(each.name), each.hash
        if text := local.definition(each):
            if whole:
                schemas[key] = Schema(key[0], MSG, text)
        elif each.hash:
            unknown[key] = list(_questions(each))
        else:
            problems[key] = "it announces no type hash"
    every = (question for some in unknown.values() for question in some)
    answers = ask(session, every, patience)
    for each in used:
        key = str(each.name), each.hash
        if key in unknown:
            mine = {question: answers[question] for question in unknown[key]}
            text, problem = _definition(each, mine)
            if text is None:
                problems[key] = problem
            else:
                schemas[key] = Schema(key[0], MSG, text)
    return schemas, problems


class _Local:
    """The definitions that this machine has, without files of the working folder."""

    def __init__(self) -> None:
        scope = Scope(Root.here())
        library = Library((), scope.root, Report(), distro=scope.distro)
        self._compiler = Compiler(library)

    def definition(self, used: UsedType) -> str | None:
        """Return the definition of a type, if it has the robot's hash."""
        interface, report = used.interface, Report()
        reached = self._compiler.reached([interface])
        if interface not in reached:
            return None
        model = self._compiler.model(interface.package, list(reached.values()), report)
        is_same = not report.had_errors and _has_hash(model, used)
        return mcap(model.interfaces[interface], model) if is_same else None


def _has_hash(model: Model, used: UsedType) -> bool:
    is_known = used.name in model.messages or used.name in model.interfaces
    return is_known and model.describer.hash(str(used.name)) == used.hash


def _questions(used: UsedType) -> Iterator[Question]:
    """Yield questions about the type, and those about the other parts of an action."""
    asked: dict[tuple[str, str], int] = {}
    for end in used.endpoints:
        key = end.type, end.hash
        if end.hash and asked.get(key, 0) < ASKED:
            asked[key] = asked.get(key, 0) + 1
            yield Question(end.node_name, *key)


def _definition(used: UsedType, answers: Mapping[Question, Answer]) -> tuple[str | None, str]:
    """Return the text of a type with all that it refers to, or the reason why there is none."""
    problems = [f"`{q.node}` {answer.problem}" for q, answer in answers.items() if answer.problem]
    for texts in _candidates(used, answers, problems):
        if (model := _linked(used, texts)) is not None:
            return mcap(model.interfaces[used.interface], model), ""
        problems.append("a node sends a definition with another type hash")
    return None, first_few(list(dict.fromkeys(problems)) or ["no node has its definition"], ASKED)


def _candidates(
    used: UsedType, answers: Mapping[Question, Answer], problems: list[str]
) -> Iterator[dict[ir.TypeName, str]]:
    """Yield definitions by name: files that nodes send, then structures that they describe."""
    interface = used.interface
    described: dict[ir.TypeName, ir.Message] = {}
    for question, answer in answers.items():
        named = ((type_name(name), text) for name, text in answer.sources.items())
        sources = {name: text for name, text in named if name and interface_of(name) == name}
        if interface in sources:
            yield sources
        if answer.description:
            try:
                model = model_of_description(answer.description, *question[1:], question.node)
            except DescriptionError as error:
                problems.append(f"`{question.node}` sends an unusable type description: {error}")
            else:
                described = {**model.messages, **described}
    suffixes = _SECTIONS[interface.kind]
    sections = [interface._replace(name=f"{interface.name}{suffix}") for suffix in suffixes]
    if all(section in described for section in sections):
        texts = {name: _text(part) for name, part in described.items() if name.kind == "msg"}
        texts[interface] = "---\n".join(_text(described[section]) for section in sections)
        yield texts


def _text(message: ir.Message) -> str:
    return message.source.text if message.source else ""


def _linked(used: UsedType, texts: Mapping[ir.TypeName, str]) -> Model | None:
    """Return the model of a type with these definitions, if it has the announced hash."""
    if sum(map(len, texts.values())) > MOST_TEXT:
        return None
    report = Report()
    own = [
        lower(parse(Source(f"{name}.{name.kind}", text)), name, report, NEWEST)
        for name, text in texts.items()
    ]
    if report.had_errors:
        return None
    model = link(used.interface.package, own, catalog, report)
    return model if not report.had_errors and _has_hash(model, used) else None
