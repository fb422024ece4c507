"""A node's tokens and bytes are those that rclpy sent through the real rmw_zenoh_cpp."""

import json
import queue

import pytest

import idlc
from idlc.robot import (
    ActionClient,
    ActionServer,
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    Node,
    QoSProfile,
    ReliabilityPolicy,
    open_session,
)
from idlc.robot.keys import EntityKind, pack_attachment, parse_attachment
from idlc.robot.qos import (
    qos_profile_parameter_events,
    qos_profile_parameters,
    qos_profile_sensor_data,
    qos_profile_services_default,
    qos_profile_system_default,
)
from tests.robot.nodes import LONG, Keyed, String, node_at, spin_until
from tests.robot.test_qos import BEST_AVAILABLE
from tests.support.paths import ROOT

CAPTURE = json.loads((ROOT / "golden/robot/rmw_zenoh.json").read_text(encoding="utf-8"))
TOKENS = [token for token, _ in CAPTURE["tokens"]]
#: The definitions of the captured types.
DEFINITIONS = {
    "msg/Drive.msg": "float64 speed\nstring who\nfloat32[] ranges\n",
    "srv/Add.srv": "int64 a\nint64 b\n---\nint64 sum\n",
    "action/Countdown.action": "int32 start\n---\nstring done\n---\nint32 left\n",
}
SESSION = TOKENS[0].split("/")[2]
BEST_EFFORT, LATCHED = ReliabilityPolicy.BEST_EFFORT, DurabilityPolicy.TRANSIENT_LOCAL
PROFILES = {
    "qos_default10": QoSProfile(depth=10),
    "qos_depth1": QoSProfile(depth=1),
    "qos_depth42": QoSProfile(depth=42),
    "qos_depth0": QoSProfile(depth=0),
    "qos_sensor": qos_profile_sensor_data,
    "qos_system": qos_profile_system_default,
    "qos_services": qos_profile_services_default,
    "qos_parameters": qos_profile_parameters,
    "qos_parameter_events": qos_profile_parameter_events,
    "qos_best_available": BEST_AVAILABLE,
    "qos_keep_all": QoSProfile(history=HistoryPolicy.KEEP_ALL, depth=10),
    "qos_best_effort": QoSProfile(depth=5, reliability=BEST_EFFORT),
    "qos_latched": QoSProfile(depth=1, durability=LATCHED),
    "qos_deadline": QoSProfile(depth=10, deadline=1_500_000_000),
    "qos_lifespan": QoSProfile(depth=10, lifespan=2 * 10**9),
    "qos_manual": QoSProfile(
        depth=10,
        liveliness=LivelinessPolicy.MANUAL_BY_TOPIC,
        liveliness_lease_duration=3 * 10**9 + 7,
    ),
    "qos_latched_best_effort": QoSProfile(depth=3, reliability=BEST_EFFORT, durability=LATCHED),
}


@pytest.fixture
def types(tmp_path):
    for name, text in DEFINITIONS.items():
        path = tmp_path / "my_robot" / name
        path.parent.mkdir(parents=True)
        path.write_text(text, encoding="utf-8")
    return idlc.load(str(tmp_path / "my_robot")).my_robot


def test_tokens_and_bytes_are_those_of_rclpy(router, types):
    identity = {"ZENOH_CONFIG_OVERRIDE": f'id="{SESSION}"'}
    tokens, samples, requests = set(), queue.SimpleQueue(), queue.SimpleQueue()
    with (
        open_session(router, environ={}, timeout=LONG) as other,
        open_session(router, environ=identity, timeout=LONG) as session,
    ):
        (drive_key, drive_attachment, drive, *_), *_ = CAPTURE["samples"]
        ((add_key, _, add_attachment, add),) = CAPTURE["requests"]
        other.transport.subscriber(Keyed(drive_key, PROFILES["qos_default10"]), samples.put)
        other.transport.service(Keyed(add_key), requests.put)
        node = Node("golden", session=session, namespace="/ns/deep", start_parameter_services=False)
        publishers = [
            node.create_publisher(types.msg.Drive, name, profile)
            for name, profile in PROFILES.items()
        ]
        node.create_subscription(String, "/absolute/name", lambda _: None, 10)
        node.create_subscription(String, "~/private", lambda _: None, 10)
        node.create_service(types.srv.Add, "add", lambda _, response: response)
        client = node.create_client(types.srv.Add, "/pure_add")
        ActionServer(node, types.action.Countdown, "count", lambda _: None)
        ActionClient(node, types.action.Countdown, "other")
        while tokens != {*TOKENS}:
            tokens = {each.token for each in other.transport.entities(0, LONG)}
            assert tokens <= {*TOKENS}

        message = types.msg.Drive(speed=1.0, who="golden", ranges=[1.0, 2.0])
        sample, sent = first(samples, lambda: publishers[0].publish(message))
        assert sample.payload.hex() == drive
        assert same_but_time(sample.attachment, drive_attachment, sent)

        request = types.srv.Add.Request(a=1, b=2)
        asked, sent = first(requests, lambda: client.call_async(request))
        assert asked.payload.hex() == add
        assert same_but_time(asked.attachment, add_attachment, sent)
        asked.drop()


def test_replies_are_those_of_rclpy(router, types):
    ((key, attachment, payload),) = CAPTURE["replies"]
    replies = queue.SimpleQueue()
    with (
        open_session(router, environ={}, timeout=LONG) as other,
        node_at(router, "golden", namespace="/ns/deep") as node,
    ):
        node.create_service(types.srv.Add, "add", lambda _, response: response)
        sequence, _, gid = parse_attachment(bytes.fromhex(attachment))
        request = types.srv.Add.Request(a=1, b=2).serialize()
        spin_until(lambda: other.graph.count(EntityKind.SERVICE, "/ns/deep/add"), node)
        other.transport.call(
            Keyed(key), request, pack_attachment(sequence, 0, gid), replies.put, timeout=LONG
        )
        spin_until(lambda: not replies.empty(), node)
        reply = replies.get(timeout=LONG)
        assert reply.payload.hex() == payload
        assert same_but_time(reply.attachment, attachment)


def first(arrived, send):
    """Return what arrives first, and how often it was sent: a declaration takes a moment."""
    sent = 0
    while True:
        send()
        sent += 1
        try:
            return arrived.get(timeout=0.1), sent
        except queue.Empty:
            continue


def same_but_time(attachment, captured, sent=1):
    """Compare with the attachment of the first message, request or reply in the capture."""
    captured = bytes.fromhex(captured)
    sequence = parse_attachment(attachment).sequence
    assert parse_attachment(captured).sequence == 1
    assert 1 <= sequence <= sent
    return attachment[:8] + attachment[16:] == sequence.to_bytes(8, "little") + captured[16:]
