"""The graph from tokens, in any order and in any number, and mismatches in it."""

import threading

import pytest

from idlc.robot import graph as graph_module
from idlc.robot.graph import Graph
from idlc.robot.keys import Entity, EntityKind, parse_token
from idlc.robot.live.overview import mismatches
from idlc.robot.qos import QoSProfile, qos_profile_sensor_data
from tests.support.waiting import LIMIT, join

HASH = "RIHS01_" + "0" * 64


class Tokens:
    """A transport whose tokens a test changes itself."""

    def __init__(self, *initial):
        self.initial = initial
        self.callback = None
        self.gone = set()

    def update(self, token, appears):
        if end := parse_token(token):
            self.callback(end, appears)

    def watch(self, domain, callback):
        assert domain == 0
        self.callback = callback
        for token in self.initial:
            if token not in self.gone:
                self.update(token, True)
        return self

    def entities(self, domain, timeout):
        assert (domain, timeout) == (0, 9.0)
        tokens, self.initial = self.initial, [t for t in self.initial if t not in self.gone]
        yield from map(parse_token, tokens)

    def close(self):
        self.callback = None


def entity(kind, number=0, name="/chatter", type_="std_msgs/msg/String", hash_=HASH, **more):
    if kind is EntityKind.NODE:
        name = type_ = hash_ = ""
    return Entity(
        domain=0,
        session="f1",
        node_id=0,
        id=number,
        kind=kind,
        node=more.pop("node", "talker"),
        name=name,
        type=type_,
        hash=hash_,
        **more,
    )


def test_an_endpoint_can_come_before_its_node_and_stay_after_it():
    tokens = Tokens()
    graph = Graph(tokens, 0)
    endpoint, node = entity(EntityKind.PUBLISHER, 1), entity(EntityKind.NODE)
    tokens.update(endpoint.token, True)
    assert graph.entities() == (endpoint,)
    tokens.update(node.token, True)
    tokens.update(node.token, True)
    assert graph.entities(EntityKind.NODE) == (node,)
    assert graph.entities() == (endpoint, node)
    tokens.update(node.token, False)
    tokens.update(node.token, False)
    assert graph.entities() == (endpoint,)
    tokens.update(endpoint.token, False)
    assert graph.entities() == ()
    assert graph.count(EntityKind.PUBLISHER, "/chatter") == 0


def test_entities_are_selected_by_all_that_is_known():
    ends = [
        entity(EntityKind.PUBLISHER, 1),
        entity(EntityKind.PUBLISHER, 2, node="other"),
        entity(EntityKind.SUBSCRIPTION, 3, type_="std_msgs/msg/Int8"),
        entity(EntityKind.SERVICE, 4, name="/add", type_="a/srv/Add"),
    ]
    graph = Graph(Tokens(*(end.token for end in ends)), 0)
    assert graph.entities(EntityKind.PUBLISHER, name="/chatter") == tuple(ends[:2])
    assert graph.entities(EntityKind.SUBSCRIPTION) == (ends[2],)
    assert graph.entities(EntityKind.CLIENT, name="/add") == ()
    assert graph.count(EntityKind.PUBLISHER, "/chatter") == 2
    assert graph.types(EntityKind.PUBLISHER, EntityKind.SUBSCRIPTION) == {
        "/chatter": ("std_msgs/msg/Int8", "std_msgs/msg/String")
    }
    assert graph.types(EntityKind.SERVICE) == {"/add": ("a/srv/Add",)}


def test_a_token_that_went_while_the_others_were_fetched_stays_away():
    stays, goes = entity(EntityKind.PUBLISHER, 1), entity(EntityKind.PUBLISHER, 2)
    tokens = Tokens(stays.token, goes.token)
    tokens.gone.add(goes.token)
    assert Graph(tokens, 0).entities() == (stays,)


class SlowTokens(Tokens):
    """Tokens of a transport that answers the first questions with this many of them."""

    def __init__(self, *initial, parts, late):
        super().__init__(*initial)
        self.parts = [*parts]
        self.late = late

    def watch(self, domain, callback):
        assert domain == 0
        self.callback = callback
        return self

    def entities(self, domain, timeout):
        assert (domain, timeout) == (0, 9.0)
        if self.callback and self.late:
            for token in self.initial:
                self.update(token, True)
        part = self.parts.pop(0) if self.parts else len(self.initial)
        yield from map(parse_token, self.initial[:part])
        if part < len(self.initial):
            raise TimeoutError


@pytest.mark.parametrize(
    ("parts", "late", "is_incomplete"),
    [
        ([0], True, False),  # asked again
        ([1, 2, 3], True, False),  # the answers grow
        ([1, 1, 1, 3], True, False),  # the watch is faster
        ([0] * 99, True, True),  # all have arrived, but no answer says so
        ([1] * 99, False, True),
        ([], False, True),  # nothing arrives
    ],
)
def test_a_slow_network_is_asked_again_or_its_graph_is_incomplete(
    parts, late, is_incomplete, monkeypatch
):
    monkeypatch.setattr(graph_module, "_SETTLED", 0.01)
    ends = [entity(EntityKind.PUBLISHER, number) for number in range(3)]
    tokens = SlowTokens(*(end.token for end in ends), parts=parts, late=late)
    graph = Graph(tokens, 0)
    assert graph.is_incomplete == is_incomplete
    assert graph.entities() == (tuple(ends) if late else ())


def test_a_closed_graph_stays_as_it_is():
    tokens = Tokens()
    graph = Graph(tokens, 0)
    publisher = entity(EntityKind.PUBLISHER)
    tokens.update(publisher.token, True)
    graph.close()
    assert tokens.callback is None
    assert graph.entities() == (publisher,)


def test_waiting_ends_with_a_change_or_with_time():
    tokens = Tokens()
    graph = Graph(tokens, 0)
    publisher = entity(EntityKind.PUBLISHER, 1)
    assert graph.wait_for(lambda graph: graph.entities(), 0) == ()
    started = threading.Event()

    def condition(graph):
        started.set()
        return graph.entities(EntityKind.PUBLISHER)

    results = []
    thread = threading.Thread(target=lambda: results.append(graph.wait_for(condition, None)))
    thread.start()
    assert started.wait(LIMIT)
    tokens.update(publisher.token, True)
    join(thread)
    assert results == [(publisher,)]


@pytest.mark.parametrize(
    ("changed", "reasons"),
    [
        ({}, ()),
        ({"hash_": "RIHS01_" + "1" * 64}, ("hash",)),
        ({"hash_": ""}, ()),
        ({"type_": "std_msgs/msg/Int8"}, ("type",)),
        ({"name": "/chattr", "type_": "std_msgs/msg/Int8"}, ()),
        ({"qos": QoSProfile(deadline=1)}, ("deadline",)),
    ],
)
def test_ends_of_one_name_are_compared(changed, reasons):
    expected = [("/chatter", "/talker", "/other", reasons)] if reasons else []
    for sends, receives in (
        (EntityKind.PUBLISHER, EntityKind.SUBSCRIPTION),
        (EntityKind.CLIENT, EntityKind.SERVICE),
    ):
        sender, receiver = entity(sends), entity(receives, 1, node="other", **changed)
        assert [*mismatches([receiver, sender])] == expected


def test_many_ends_of_one_topic_do_not_cost_the_square():
    offered = [entity(EntityKind.PUBLISHER, n, qos=qos_profile_sensor_data) for n in range(1000)]
    requested = [entity(EntityKind.SUBSCRIPTION, n) for n in range(1000)]
    assert sum(1 for _ in mismatches([*offered, *requested])) == 100_000
