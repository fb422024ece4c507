"""The pipeline of `idlc breaking --against graph`: what runs, and what is here, compared."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from typing import NamedTuple, get_args

from idlc.breaking import versions as comparison
from idlc.breaking.change import LEVELS, Change
from idlc.breaking.graph import (
    Endpoint,
    Entity,
    Here,
    Version,
    event_of,
    interface_of,
    several_types,
    several_versions,
)
from idlc.checks.size import oversized
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report, first_few
from idlc.disk.find import look, nothing_in
from idlc.disk.library import Library
from idlc.disk.machine import graph as running
from idlc.disk.packages import inputs
from idlc.disk.scope import Scope
from idlc.driver.compare.breaking import BreakingOptions, not_allowed
from idlc.driver.stages import Compiler, models_of, stage
from idlc.model import ir
from idlc.model.described import NotBelievedError
from idlc.model.link import Model
from idlc.model.told import told

#: A structure's full name and type hash.
Key = tuple[str, str]
_NO_NODE = "there is no node that could be asked"
_SERVICE = (
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
    with running.joined(report) as graph:
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
    there = look(options.paths, report, options.scope.exclude)
    if is_given:
        report.extend(nothing_in(one, options.scope.exclude) for one in there.empty)
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
    library = Library(scope.include, dropped, distro=scope.distro)
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
) -> Iterator[tuple[Key, list[running.Question]]]:
    """Yield what to ask about each version that is not known.

    A node knows a service by the hash of the whole, which only service introspection tells: the
    description of its events holds request and response.
    """
    events = [one for one in endpoints if one.structure.endswith("_Event") and one.hash]
    for version in chain.from_iterable(found):
        key = (version.type, version.hash)
        if key not in known:
            wanted = [running.Question(node, *key) for node in version.nodes[: running.ASKED]]
            if event := event_of(version.type):
                mine = (
                    one for one in events if one.structure == event and one.node in version.nodes
                )
                wanted = [running.Question(one.node, one.structure, one.hash) for one in mine]
            yield key, wanted


def _learn(
    questions: Mapping[Key, Sequence[running.Question]],
    answers: Mapping[running.Question, running.Answer],
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
                    model = told(description, sources, name, type_hash, node)
                    if any(oversized(model)):
                        raise NotBelievedError("it is larger than anybody can use")
                except NotBelievedError as error:
                    problem = f"is not believed: {error}"
                else:
                    list(_add(model, known))
            if problem:
                problems.setdefault(key, []).append(f"`{node}` {problem}")
    return {
        key: first_few(problems.get(key, [_SERVICE if event_of(key[0]) else _NO_NODE]), 3)
        for key in questions
        if key not in known
    }


def _changes(
    found: Iterable[Sequence[Version]], known: Mapping[Key, Model], problems: Mapping[Key, str]
) -> Iterator[Change]:
    seen: comparison.Seen = set()
    for versions in found:
        yield from comparison.changes(versions, known, problems, seen)
