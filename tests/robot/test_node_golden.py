"""A node's tokens and bytes are those that rclpy sent through the real rmw_zenoh_cpp."""

import json
import queue

from idlc.robot import (
    Client,
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    Node,
    QoSProfile,
    ReliabilityPolicy,
    open_session,
)
from idlc.robot.keys import Kind, all_tokens, parse_attachment, parse_token
from idlc.robot.nodes.interfaces import Interface
from idlc.robot.qos import (
    qos_profile_best_available,
    qos_profile_parameter_events,
    qos_profile_parameters,
    qos_profile_sensor_data,
    qos_profile_services_default,
    qos_profile_system_default,
)
from tests.robot.nodes import LONG, String
from tests.support.paths import ROOT

CAPTURE = json.loads((ROOT / "golden/robot/rmw_zenoh.json").read_text(encoding="utf-8"))
TOKENS = [token for token, _ in CAPTURE["tokens"]]
#: Endpoints of actions follow.
OWN = 25
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
    "qos_best_available": qos_profile_best_available,
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


def captured(kind, name):
    """Return the type of a captured endpoint."""
    entities = [parse_token(token) for token in TOKENS]
    entity = next(each for each in entities if (each.kind, each.name) == (kind, name))

    class Bytes:
        """Messages as bytes: the definition of the captured type is not known."""

        Request = Response = None

        def __init__(self, data):
            self.data = data

        def serialize(self):
            return self.data

    Bytes.Request = Bytes
    return Interface(entity.type, entity.hash, lambda: Bytes)


def test_tokens_and_bytes_are_those_of_rclpy(router):
    identity = {"ZENOH_CONFIG_OVERRIDE": f'id="{SESSION}"'}
    tokens, samples, requests = set(), queue.SimpleQueue(), queue.SimpleQueue()
    with (
        open_session(router, environ={}, timeout=LONG) as other,
        open_session(router, environ=identity, timeout=LONG) as session,
    ):
        drive = CAPTURE["samples"]
        key, _, attachment, payload = CAPTURE["requests"][0]
        other.transport.subscriber(drive[0][0], PROFILES["qos_default10"], samples.put)
        other.transport.service(key, requests.put)
        node = Node("golden", session=session, namespace="/ns/deep", start_parameter_services=False)
        publishers = [
            node._publisher(name, captured(Kind.PUBLISHER, f"/ns/deep/{name}"), profile)
            for name, profile in PROFILES.items()
        ]
        node.create_subscription(String, "/absolute/name", lambda _: None, 10)
        node.create_subscription(String, "~/private", lambda _: None, 10)
        node._service("add", captured(Kind.SERVICE, "/ns/deep/add"), lambda *_: None)
        add = captured(Kind.CLIENT, "/pure_add")
        client = Client(node, "/pure_add", add, qos_profile_services_default)
        while tokens != {*TOKENS[:OWN]}:
            tokens = {*other.transport.tokens(all_tokens(0), LONG)}
            assert tokens <= {*TOKENS[:OWN]}
        assert publishers[0].entity.gid.hex() == drive[0][1][-32:]

        sample = None
        while sample is None:  # the declaration of a subscriber takes a moment to arrive
            publishers[0].publish(bytes.fromhex(drive[0][2]))
            publishers[0]._count = 0
            try:
                sample = samples.get(timeout=0.1)
            except queue.Empty:
                continue
        assert sample.key == drive[0][0]
        assert sample.payload.hex() == drive[0][2]
        assert same_but_time(sample.attachment, drive[0][1])

        request = None
        while request is None:
            client.call_async(add.kind(bytes.fromhex(payload)))
            try:
                request = requests.get(timeout=0.1)
            except queue.Empty:
                continue
        sequence = parse_attachment(request.attachment).sequence
        assert request.payload.hex() == payload
        wanted = sequence.to_bytes(8, "little").hex() + attachment[16:]
        assert same_but_time(request.attachment, wanted)
        request.drop()


def same_but_time(attachment, expected):
    return attachment[:8].hex() + attachment[16:].hex() == expected[:16] + expected[32:]
