"""A graph of nodes that do not run: which ends they have, and what they say of their types."""

from contextlib import contextmanager

from idlc.robot.live.graph import GraphEndpoint
from idlc.tasks.breaking.graph import Answer

ROLES = {
    "publisher": ("topic", True),
    "subscription": ("topic", False),
    "server": ("service", False),
    "client": ("service", True),
}


def end(node, role, name, type_, hash_):
    """Return the end of a topic, or the one of a service that requests pass."""
    entity, sends = ROLES[role]
    return GraphEndpoint(node, entity, name, role, sends, type_, hash_)


def hash_of(model, type_):
    return model.describer.hash(type_)


class RecordedGraph:
    """`told` has the answers by node; the others do not answer.

    `sources` has the texts that a node tells, by type.
    """

    has_hashes_of_services = False

    def __init__(self, ends, told=None, sources=None):
        self.sources = sources or {}
        self.ends = tuple(sorted(ends))
        self.told = told or {}
        self.asked = []

    def endpoints(self, _patience):
        return self.ends

    def ask(self, questions, _patience):
        self.asked = list(questions)
        return {one: self._answer(one) for one in self.asked}

    def _answer(self, question):
        told = self.told.get(question.node)
        if isinstance(told, str):
            return Answer(None, told)
        if told is None or (question.type, question.hash) not in told:
            return Answer(None, "does not answer")
        sources = self.sources.get(question.node, {})
        return Answer(told[question.type, question.hash], sources=sources)


def descriptions(model, *types):
    """Return what a node with these types of a model says of them."""
    return {(type_, hash_of(model, type_)): model.describer.description(type_) for type_ in types}


def take_the_place(monkeypatch, graph):
    """Let idlc see this graph; `None` is that of a Python without rclpy."""

    @contextmanager
    def joined(report):
        yield graph

    if graph is None:
        monkeypatch.setattr("idlc.tasks.breaking.graph.import_module", _missing)
    else:
        monkeypatch.setattr("idlc.tasks.breaking.graph.join_graph", joined)


def _missing(name):
    raise ModuleNotFoundError(f"No module named '{name}'")
