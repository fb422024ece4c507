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
from idlc.recordings.definition_text import mcap
from idlc.recordings.definitions import (
    RecordedDefinition,
    TextCache,
    interface_of,
    read_definition,
    type_name,
)
from idlc.recordings.memory import class_in, home_of
from idlc.robot.keys import Entity, Kind
from idlc.robot.live.connect import call, connected, place_of, robot_entities
from idlc.robot.live.graph import Answer, Question, answer_of
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
Key: TypeAlias = tuple[str, str]


def _compiler() -> Compiler:
    """Return a compiler of what this machine has, without files of the working folder."""
    scope = Scope(Root.here())
    return Compiler(Library((), scope.root, Report(), distro=scope.distro))


@cache
def _describe_class() -> Any:
    name = ir.TypeName.parse(DESCRIBE)
    compiler = _compiler()
    return class_in(home_of(compiler.models(compiler.reached([name]), Report())), name)


def ask(
    session: Session, questions: Iterable[Question], patience: float = PATIENCE
) -> dict[Question, Answer]:
    """Return the nodes' answers within `patience` seconds; each question has one."""
    questions = list(dict.fromkeys(questions))
    servers = robot_entities(session, Kind.SERVICE)
    services = {end.node_name: end for end in servers if end.type == DESCRIBE}
    answers = {each: answer_of(None, each.node in services) for each in questions}
    offered = [question for question in questions if question.node in services]
    requests = ((services[node], _request(name, hash_)) for node, name, hash_ in offered)
    room = MOST_REPLIES
    for number, payload in call(session, requests, patience, again=True):
        room -= len(payload)
        if room >= 0:
            answers[offered[number]] = _answer(payload)
    return answers


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
        ends = (end for end in robot_entities(session) if end.kind is not Kind.NODE)
        whole = [end for end in ends if place_of(end)[2] in ("", "feedback")]
        return definitions(session, address, whole)


def definitions(
    session: Session, address: str, ends: Iterable[Entity], *, whole: bool = False
) -> tuple[RecordedDefinition, ...]:
    """Return the definitions of what endpoints use, one for each name and version of its type.

    `address` is the robot's name in reports. An action is defined by its feedback. Local types with
    the right hash have no definition of the robot's, unless `whole` asks for their own.
    """
    users: dict[Key, list[Entity]] = {}
    parts: dict[tuple[str, str], list[Entity]] = {}
    for end in ends:
        users.setdefault((end.type, end.hash), []).append(end)
    for end in robot_entities(session):
        part = place_of(end)[1:]
        if part[1] in _PARTS and len(mine := parts.setdefault(part, [])) < MOST_OF_A_PART:
            mine.append(end)
    compiler = _compiler()
    questions: dict[Key, list[Question]] = {}
    results: dict[Key, tuple[str, str]] = {}
    places: dict[tuple[str, Key], None] = {}
    for key, mine in users.items():
        names = dict.fromkeys(place_of(end)[1] for end in mine)
        places |= dict.fromkeys((name, key) for name in names)
        type_ = type_name(key[0])
        if type_ and (text := _local_text(compiler, type_, key[1])):
            results[key] = text if whole else "", ""
        elif type_ and key[1]:
            others = chain(*(parts.get(part, ()) for part in product(names, _PARTS)))
            questions[key] = [*_questions(type_, (*mine, *others))]
    answers = ask(session, chain(*questions.values()))
    for key, asked in questions.items():
        results[key] = _definition(key, {each: answers[each] for each in asked})
    cache: TextCache = {}
    read = []
    for name, key in places:
        no_hash = "" if key[1] else "it announces no type hash"
        text, problem = results.get(key, ("", no_hash))
        schema = Schema(key[0], MSG, text) if text else None
        topic = Topic(name, key[0], 0, key[1] or None, CDR, schema)
        definition = read_definition(topic, address, cache)
        read.append(definition._replace(origin="the robot", problem=problem))
    return tuple(read)


def _local_text(compiler: Compiler, name: ir.TypeName, hash_: str) -> str | None:
    """Return the definition of a type on this machine, if it has the robot's hash."""
    interface, report = interface_of(name), Report()
    reached = compiler.reached([interface])
    model = compiler.model(interface.package, list(reached.values()), report)
    is_same = not report.had_errors and model.hash(name) == hash_
    return mcap(model.interfaces[interface], model) if is_same else None


def _questions(name: ir.TypeName, ends: Iterable[Entity]) -> Iterator[Question]:
    """Yield questions about the parts of an interface to the nodes that use them."""
    interface = interface_of(name)
    asked: Counter[Key] = Counter()
    for end in dict.fromkeys(ends):
        key, own = (end.type, end.hash), type_name(end.type)
        asked[key] += 1
        if end.hash and asked[key] <= ASKED and own and interface_of(own) == interface:
            yield Question(end.node_name, *key)


def _definition(key: Key, answers: Mapping[Question, Answer]) -> tuple[str, str]:
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
                return mcap(linked.interfaces[interface], linked), ""
            problems.append("a node sends a definition with another type hash")
    return "", first_few(list(dict.fromkeys(problems)) or ["no node has its definition"], ASKED)
