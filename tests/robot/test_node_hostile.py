"""Whatever others send, a node ignores it or raises nothing; memory stays bounded."""

import gc
import random
import sys
import threading
import time
from types import SimpleNamespace

import pytest

from idlc.robot import Future, QoSProfile, open_session
from idlc.robot.keys import Entity, EntityKind, pack_attachment
from idlc.robot.transport import Sample
from tests.robot.nodes import LONG, SetBool, String, node_at, spin_until

GID = bytes(16)


class Request:
    """A request as a transport passes it on."""

    def __init__(self, payload, attachment):
        self.payload, self.attachment = payload, attachment
        self.replies, self.dropped = [], 0

    def reply(self, payload, attachment):
        self.replies.append((payload, attachment))

    def drop(self):
        self.dropped += 1


@pytest.fixture
def node(router):
    with node_at(router, "node") as node:
        yield node


def mutated(rng, data):
    """Return bytes with a few changes."""
    result = bytearray(data)
    for _ in range(rng.randrange(1, 4)):
        match rng.randrange(3):
            case 0 if result:
                result[rng.randrange(len(result))] = rng.randrange(256)
            case 1:
                del result[rng.randrange(len(result) + 1) :]
            case _:
                result += rng.randbytes(rng.randrange(8))
    return bytes(result)


def test_mutated_messages_requests_and_responses_are_ignored(node, capsys, monkeypatch):
    # as if no test had warned before, and as if no time passed
    monkeypatch.setattr("idlc.robot.nodes.logger._quiet", {})
    clock = SimpleNamespace(monotonic=lambda: 0.0, time_ns=time.time_ns)
    monkeypatch.setattr("idlc.robot.nodes.logger.time", clock)
    rng = random.Random(29)
    received = []
    subscription = node.create_subscription(String, "chatter", received.append, 10)
    service = node.create_service(SetBool, "set", lambda _, response: response)
    client = node.create_client(SetBool, "set")
    message = String(data="hello").serialize()
    request = SetBool.Request(data=True).serialize()
    response = SetBool.Response(message="x").serialize()
    requests = []
    for number in range(20_000):
        attachment = pack_attachment(number, 2, GID)
        match number % 3:
            case 0:
                payload, attached = mutated(rng, message), mutated(rng, attachment)
                subscription._receive(Sample(rng.choice([message, payload]), attached))
            case 1:
                payload, attached = mutated(rng, request), mutated(rng, attachment)
                requests.append(Request(payload, rng.choice([attachment, attached])))
                service._receive(requests[-1])
            case _:
                client._pending[number] = Future()
                attached = rng.choice([attachment, mutated(rng, attachment)])
                client._receive(number, Sample(mutated(rng, response), attached))
        if number % 10 == 0:
            while node.executor._queue.qsize():
                node.executor.spin_once(timeout_sec=0)
    spin_until(lambda: not len(subscription._queue) and not len(service._queue), node)
    assert received
    assert subscription.ignored > 1000
    assert service.ignored > 1000
    assert client.ignored > 1000
    assert all(len(each.replies) + each.dropped == 1 for each in requests)
    assert service._open == set()
    # one warning for all that could not be decoded, and one of a first message that is too long
    said = capsys.readouterr().err
    assert said.count("idlc ignores data") == 1
    assert said.count("[WARN]") == 1 + said.count("bytes that std_srvs/srv/SetBool")


def test_a_message_that_is_longer_than_its_type_is_reported_once(node, capsys):
    received = []
    subscription = node.create_subscription(String, "/longer", received.append, 10)
    attachment = pack_attachment(1, 2, GID)
    for _ in range(2):
        payload = String(data="x").serialize() + bytes(8)
        subscription._receive(Sample(payload, attachment))
    spin_until(lambda: len(received) == 2, node)
    assert capsys.readouterr().err.count("has 8 bytes that std_msgs/msg/String does not") == 1


def test_a_flood_is_bounded(node):
    subscription = node.create_subscription(String, "chatter", lambda _: None, 5)
    service = node.create_service(SetBool, "set", lambda _, response: response)
    waiting = node.executor._queue.qsize()
    payload = SetBool.Request().serialize()
    requests = [Request(payload, pack_attachment(number % 40, 2, GID)) for number in range(100)]
    for number, request in enumerate(requests):
        subscription._receive(Sample(b"", pack_attachment(number, 2, GID)))
        service._receive(request)
    assert len(subscription._queue) == 5
    assert len(service._queue) == len(service._open) == 10
    assert sum(each.dropped for each in requests) == 90
    assert node.executor._queue.qsize() <= waiting + 2
    node.destroy_service(service)
    node.destroy_subscription(subscription)
    assert sum(each.dropped for each in requests) == 100


def test_a_response_ends_spin_once(node):
    """As in the loop of ROS 2's own examples; that no service answers is a response, too."""
    future = node.create_client(SetBool, "nowhere").call_async(SetBool.Request())
    thread = threading.Thread(target=node.executor.spin_once, daemon=True)
    thread.start()
    thread.join(LONG)
    assert not thread.is_alive()
    assert future.done()


def test_a_service_that_replies_for_ever_is_cut_short(node, router):
    client = node.create_client(SetBool, "set")
    with open_session(router, environ={}, timeout=LONG) as other:
        held = []

        def reply(request):
            for number in range(64):
                attachment = request.attachment if number % 2 else b""
                request._query.reply(client.entity.key, b"", attachment=attachment)
            held.append(request)
            request.drop()

        other.transport.service(client.entity, reply)
        other.transport.announce(
            Entity(
                domain=0,
                session=other.id,
                node_id=0,
                id=1,
                kind=EntityKind.SERVICE,
                node="hostile",
                name="/set",
                type=client.interface.name,
                hash=client.interface.hash,
            )
        )
        assert client.wait_for_service(timeout_sec=LONG)
        future = client.call_async(SetBool.Request())
        # the future ends with the first response, while the service still sends others
        spin_until(lambda: future.done() and held, node)
        assert client.ignored
        assert "sent data that is not its response" in str(future.exception())
        assert client._pending == {}


def test_real_sends_without_attachments_are_counted(node, router):
    subscription = node.create_subscription(String, "chatter", lambda _: None, 5)
    service = node.create_service(SetBool, "set", lambda _, response: response)
    with open_session(router, environ={}, timeout=LONG) as other:
        sender = other.transport.publisher(subscription.entity)
        ended = []
        while not (subscription.ignored and service.ignored):
            sender.put(b"\xff", attachment=b"")
            other.transport.call(service.entity, b"", b"x" * 32, ended.append, timeout=LONG)
            node.executor.spin_once(timeout_sec=0.01)


@pytest.mark.parametrize("count", [10_000, pytest.param(10**6, marks=pytest.mark.long)])
def test_memory_does_not_grow_with_messages(node, router, count):
    received = 0

    def receive(_):
        nonlocal received
        received += 1

    node.create_subscription(String, "chatter", receive, QoSProfile(depth=1000))
    with node_at(router, "other") as other:
        publisher = other.create_publisher(String, "chatter", QoSProfile(depth=1000))
        spin_until(publisher.get_subscription_count, node)
        message, blocks = String(data="hello"), []
        for number in range(1, count + 1):
            publisher.publish(message)
            if number % 500 == 0:
                spin_until(lambda: received == number, node)  # noqa: B023 - called at once
            if number % (count // 10) == 0:
                gc.collect()
                blocks.append(sys.getallocatedblocks())
    assert blocks[-1] - blocks[0] < 5000
