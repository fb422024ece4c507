"""The types that a robot uses, as the topics of a recording.

Nodes send definitions of their types on request. A definition is accepted only if it has the hash
that the endpoint announces. Types that are known locally with that hash are not requested.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from itertools import chain, product
from typing import Any, TypeAlias

from idlc.compiler.compiler import Compiler
from idlc.diagnostics.report import Report, first_few
from idlc.diagnostics.source import INCOMPLETE
from idlc.model import ir
from idlc.model.from_description import (
    DescriptionError,
    defaults_of,
    model_of_description,
    model_of_sources,
    node_texts,
)
from idlc.model.node_sources import Defaults
from idlc.project.library import Library
from idlc.project.root import Root
from idlc.project.settings import Scope
from idlc.recordings.containers.file import CDR, MSG, Schema, Topic
from idlc.recordings.definitions import (
    ROBOT,
    RecordedDefinition,
    TextCache,
    interface_of,
    mcap_text,
    read_definition,
    type_name,
)
from idlc.recordings.memory import class_in, home_of
from idlc.robot.keys import Entity, EntityKind
from idlc.robot.live.connect import call, connected, place_of, robot_entities
from idlc.robot.live.graph import Answer, TypeQuestion, answer_of
from idlc.robot.session import Session

#: Seconds that idlc waits for all replies of a robot.
PATIENCE = 5.0
#: Nodes that are asked about one type.
ASKED = 3
#: The parts of an action whose descriptions contain its goal and result, and endpoints of each.
_PARTS = ("send_goal", "get_result")
MOST_OF_A_PART = 10
#: Bytes of all replies together.
MOST_REPLIES = 64 << 20
DESCRIBE = "type_description_interfaces/srv/GetTypeDescription"
#: The name of a type and its hash.
TypeKey: TypeAlias = tuple[str, str]


def _compiler(include: tuple[str, ...] = ()) -> Compiler:
    """Return a compiler of what this machine has, without other files of the working folder."""
    scope = Scope(Root.here())
    return Compiler(Library(include, scope.root, Report(), distro=scope.distro))


@cache
def _describe_class() -> Any:
    name = ir.TypeName.parse(DESCRIBE)
    compiler = _compiler()
    return class_in(home_of(compiler.models(compiler.reached([name]), Report())), name)


def ask(
    session: Session, questions: Iterable[TypeQuestion], patience: float = PATIENCE
) -> dict[TypeQuestion, Answer]:
    """Return the nodes' answers within `patience` seconds; each question has one."""
    questions = list(dict.fromkeys(questions))
    services = _describers(session)
    answers = {each: answer_of(None, each.node in services) for each in questions}
    answers.update(_replies(session, services, questions, patience))
    return answers


def _describers(session: Session) -> dict[str, Entity]:
    servers = robot_entities(session, EntityKind.SERVICE)
    return {end.node_name: end for end in servers if end.type == DESCRIBE}


def _replies(
    session: Session,
    services: Mapping[str, Entity],
    questions: Iterable[TypeQuestion],
    patience: float = PATIENCE,
) -> Iterator[tuple[TypeQuestion, Answer]]:
    """Yield questions with the nodes' answers as these arrive, for `patience` seconds."""
    offered = [question for question in questions if question.node in services]
    requests = ((services[node], _request(name, hash_)) for node, name, hash_ in offered)
    room = MOST_REPLIES
    for number, payload in call(session, requests, patience, again=True):
        room -= len(payload)
        if room >= 0:
            yield offered[number], _answer(payload)


def _request(name: str, hash_: str) -> Any:
    return _describe_class().Request(type_name=name, type_hash=hash_, include_type_sources=True)


def _answer(payload: bytes) -> Answer:
    try:
        return answer_of(_describe_class().Response.deserialize(payload), True)
    except ValueError:
        return Answer(None, "sends a malformed reply")


def read_robot(address: str, report: Report) -> tuple[RecordedDefinition, ...] | None:
    """Return topics, services and actions of a robot, with verified definitions.

    It is `None` after an error, which is reported.
    """
    with connected(address, report) as session:
        if session is None:
            return None
        ends = (end for end in robot_entities(session) if end.kind is not EntityKind.NODE)
        whole = [end for end in ends if place_of(end)[2] in ("", "feedback")]
        # in the order of the names, whoever answers first
        every = definitions(session, address, whole)
        return tuple(sorted(every, key=lambda each: (each.topic.name, each.topic.type)))


def definitions(
    session: Session,
    address: str,
    ends: Iterable[Entity],
    *,
    whole: bool = False,
    include: tuple[str, ...] = (),
) -> Iterator[RecordedDefinition]:
    """Yield the definitions of what endpoints use, one for each name and version of its type.

    They come as nodes answer.

    `address` is the robot's name in reports. An action is defined by its feedback. Local types with
    the right hash have no definition of the robot's, unless `whole` asks for their own. Then local
    types also define what endpoints announce without a hash.
    """
    users: dict[TypeKey, list[Entity]] = {}
    for end in ends:
        users.setdefault((end.type, end.hash), []).append(end)
    parts = _parts_of_actions(session)
    compiler = _compiler(include)
    cache: TextCache = {}
    asked: dict[TypeKey, list[TypeQuestion]] = {}

    def read(key: TypeKey, text: str, problem: str) -> Iterator[RecordedDefinition]:
        schema = Schema(key[0], MSG, text) if text else None
        for name in dict.fromkeys(place_of(end)[1] for end in users[key]):
            topic = Topic(name, key[0], 0, key[1] or None, CDR, schema)
            definition = read_definition(topic, address, cache)
            yield definition._replace(origin=ROBOT, problem=problem)

    for key, mine in users.items():
        type_ = type_name(key[0])
        if type_ and (text := _local_text(compiler, type_, key[1], unsure=whole)):
            yield from read(key, text if whole else "", "")
        elif type_ and key[1]:
            names = dict.fromkeys(place_of(end)[1] for end in mine)
            others = chain(*(parts.get(part, ()) for part in product(names, _PARTS)))
            asked[key] = [*_questions(type_, (*mine, *others))]
        else:
            yield from read(key, "", "" if key[1] else "it announces no type hash")
    for key, text, problem in _answered(session, asked):
        yield from read(key, text, problem)


def _parts_of_actions(session: Session) -> dict[tuple[str, str], list[Entity]]:
    """Return endpoints of actions whose descriptions contain goals and results."""
    parts: dict[tuple[str, str], list[Entity]] = {}
    for end in robot_entities(session):
        part = place_of(end)[1:]
        if part[1] in _PARTS and len(mine := parts.setdefault(part, [])) < MOST_OF_A_PART:
            mine.append(end)
    return parts


def _answered(
    session: Session, asked: Mapping[TypeKey, list[TypeQuestion]]
) -> Iterator[tuple[TypeKey, str, str]]:
    """Yield each type with its text, or the reason why there is none, as nodes answer."""
    services = _describers(session)
    answers: dict[TypeKey, dict[TypeQuestion, Answer]] = {}
    users: dict[TypeQuestion, list[TypeKey]] = {}
    for key, questions in asked.items():
        answers[key] = {each: answer_of(None, each.node in services) for each in questions}
        for question in answers[key]:
            users.setdefault(question, []).append(key)
    for question, answer in _replies(session, services, users):
        for key in users[question]:
            if key in answers:
                answers[key][question] = answer
                text, problem = _definition(key, answers[key])
                if text and INCOMPLETE not in text:
                    del answers[key]
                    yield key, text, problem
    for key, known in answers.items():
        yield key, *_definition(key, known)


def _local_text(compiler: Compiler, name: ir.TypeName, hash_: str, *, unsure: bool) -> str | None:
    """Return the definition of a type on this machine, if it has the robot's hash.

    If the robot announces none, any definition will do for the `unsure`.
    """
    interface, report = interface_of(name), Report()
    reached = compiler.reached([interface])
    model = compiler.model(interface.package, list(reached.values()), report)
    is_same = model.hash(name) == hash_ or (unsure and not hash_ and interface in reached)
    is_sound = is_same and not report.had_errors
    return mcap_text(model.interfaces[interface], model) if is_sound else None


def _questions(name: ir.TypeName, ends: Iterable[Entity]) -> Iterator[TypeQuestion]:
    """Yield questions about the parts of an interface to the nodes that use them."""
    interface = interface_of(name)
    asked: Counter[TypeKey] = Counter()
    for end in dict.fromkeys(ends):
        key, own = (end.type, end.hash), type_name(end.type)
        asked[key] += 1
        if end.hash and asked[key] <= ASKED and own and interface_of(own) == interface:
            yield TypeQuestion(end.node_name, *key)


def _definition(key: TypeKey, answers: Mapping[TypeQuestion, Answer]) -> tuple[str, str]:
    """Return the text of a type with all that it refers to, or else the reason why not."""
    name = ir.TypeName.parse(key[0])
    interface = interface_of(name)
    problems = [f"`{each.node}` {own.problem}" for each, own in answers.items() if own.problem]
    described: dict[ir.TypeName, ir.Message] = {}
    defaults: Defaults = {}
    for question, answer in answers.items():
        try:
            if answer.description:
                model = model_of_description(answer.description, *question[1:], question.node)
                described = {**model.messages, **described}
                defaults = {**defaults_of(answer.description), **defaults}
        except DescriptionError as error:
            problems.append(f"`{question.node}` sends an unusable type description: {error}")
    names = {own for own in described if own.kind == "msg"} | {interface}
    candidates = [
        node_texts(names, answer.sources, described, defaults) for answer in answers.values()
    ]
    for texts in sorted(candidates, key=lambda each: str(each.values()).count(INCOMPLETE)):
        if interface in texts:
            if linked := model_of_sources(texts, name, key[1]):
                return mcap_text(linked.interfaces[interface], linked), ""
            problems.append("a node sends a definition with another type hash")
    return "", first_few(list(dict.fromkeys(problems)) or ["no node has its definition"], ASKED)
