"""idlc.robot among the public libraries that speak its protocol: pyzeros and zenoh-ros2-sdk.

A router, two programs of idlc.robot and one of each library run at once. Each program NAME
* publishes on /joints what it receives on /NAME/say, and on /NAME/seen what it receives on /joints;
* serves /NAME/set, and calls the service that /NAME/ask names;
* subscribes late to the topic that /NAME/join names;
* publishes on /NAME/heard what it is answered, and what it receives late.

The versions are those of maintenance/requirements/test-robot.txt. Other than rmw_zenoh does,
* pyzeros has no transient local QoS: it raises NotImplementedError;
* publishers of zenoh-ros2-sdk announce transient local QoS and keep nothing, and its late
  subscriptions ask for the newest message alone. Its GIDs are random, so that a message does not
  tell its publisher, and each of its endpoints is in a node of its own;
* both count messages from 0, and offer no descriptions of types.
"""

import json
import os
import subprocess
import sys
import threading
from contextlib import ExitStack
from importlib.util import find_spec

import pytest

import idlc
from idlc.cli.main import main
from idlc.robot import QoSProfile
from idlc.robot.keys import EntityKind, parse_attachment
from idlc.robot.qos import DurabilityPolicy
from tests.robot.conftest import free_endpoint
from tests.robot.nodes import LONG, SetBool, String, node_at, spin_until
from tests.support.generated import catalog_files
from tests.support.paths import ROOT
from tests.support.waiting import WORK, join, wait_for

#: `make test-robot` sets it: whatever is missing fails.
IS_COMPLETE = "IDLC_PEERS" in os.environ
#: The names of the nodes, and their programs in tests/robot/programs.
PROGRAMS = {
    "left": "ours.py",
    "right": "ours.py",
    "pyzeros": "of_pyzeros.py",
    "zenoh_ros2_sdk": "of_zenoh_ros2_sdk.py",
}
JointState = idlc.load("sensor_msgs/msg/JointState").JointState
STATE = {
    "header": {"stamp": {"sec": 3, "nanosec": 5}, "frame_id": "Gehäuse"},
    "name": ["elbow", ""],
    "position": [1.5, -2e300],
    "velocity": [],
    "effort": [0.1],
}
LATCHED = QoSProfile(depth=5, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def lack(name):
    """Return why a program cannot run; it is empty if it can, or has to."""
    if name == "pyzeros" and sys.version_info < (3, 11):
        return "pyzeros needs Python 3.11"
    if PROGRAMS[name] == "ours.py" or IS_COMPLETE or find_spec(name):
        return ""
    return f"{name} is not installed: run `make test-robot`"


PRESENT = [name for name in PROGRAMS if not lack(name)]


def each(*names):
    marked = [
        pytest.param(name, marks=pytest.mark.skipif(bool(lack(name)), reason=lack(name)))
        for name in names
    ]
    return pytest.mark.parametrize("name", marked)


def environment(folder):
    """Return the variables of programs, which may use neither this machine's ROS nor a network."""
    return {
        "CYDR_CACHE_DIR": str(folder / "cydr"),  # where pyzeros compiles, if nobody says where
        **os.environ,
        "PYTHONPATH": str(ROOT),
        "ZENOH_ROS2_SDK_CACHE": str(folder / "cloned"),
        "GIT_ALLOW_PROTOCOL": "none",
    }


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    """The endpoint of the router, at which all programs are, and a node of this process."""
    folder = tmp_path_factory.mktemp("network")
    for package, files in catalog_files().items():
        for name, text in files.items():
            path = folder / package / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
    endpoint = free_endpoint()
    variables = environment(folder)
    with ExitStack() as stack:
        logs = {}

        def start(name, *words, **more):
            logs[name] = folder / f"{name}.log"
            output = stack.enter_context(logs[name].open("w"))
            process = subprocess.Popen(
                [sys.executable, *words], env=variables | more, stdout=output, stderr=output
            )
            stack.callback(process.wait, LONG)
            stack.callback(process.kill)
            return process

        router = start("router", "-m", "idlc", "router", "--listen", endpoint)

        def listens():
            assert router.poll() is None, logs["router"].read_text()
            return "listening" in logs["router"].read_text()

        wait_for(listens)
        # a client of the router and, as every node of rmw_zenoh is, a peer
        overrides = {"right": 'mode="peer";listen/endpoints=["tcp/127.0.0.1:0"]'}
        processes = {}
        for name in PRESENT:
            program = ROOT / "tests/robot/programs" / PROGRAMS[name]
            more = {"ZENOH_CONFIG_OVERRIDE": overrides[name]} if name in overrides else {}
            processes[name] = start(name, program, endpoint, name, folder, **more)
        node = stack.enter_context(node_at(endpoint, "tester"))
        node.create_service(SetBool, "~/set", answer)
        for name, process in processes.items():

            def is_there(name=name, process=process):
                assert process.poll() is None, logs[name].read_text()
                return node.graph.count(EntityKind.SERVICE, f"/{name}/set")

            # pyzeros compiles
            wait_for(is_there, logs[name].read_text, limit=WORK)
        yield endpoint, node
        for name, process in processes.items():
            assert process.poll() is None, logs[name].read_text()


def answer(request, response):
    response.success, response.message = request.data, "set by tester"
    return response


def repeat(node, kind, topic, message, condition):
    """Publish until a condition holds: a declaration takes a moment to arrive everywhere."""
    publisher = node.create_publisher(kind, topic, 10)

    def publish():
        publisher.publish(message)
        for _ in range(10):
            node.executor.spin_once(timeout_sec=0.05)

    wait_for(condition, between=publish)
    node.destroy_publisher(publisher)


def heard_by(node, name):
    """Return a list that fills with what a program is answered and receives late."""
    heard = []
    node.create_subscription(String, f"/{name}/heard", lambda m: heard.append(m.data), 10)
    return heard


@each(*PROGRAMS)
def test_messages_of_each_arrive_at_all(network, name):
    _, node = network
    state = JointState.from_dict({**STATE, "effort": [float(list(PROGRAMS).index(name))]})
    seen = {other: [] for other in PRESENT}
    subscriptions = [
        node.create_subscription(JointState, f"/{other}/seen", seen[other].append, 10)
        for other in PRESENT
    ]
    repeat(
        node,
        JointState,
        f"/{name}/say",
        state,
        lambda: all(state in messages for messages in seen.values()),
    )
    for subscription in subscriptions:
        node.destroy_subscription(subscription)


@each(*PROGRAMS)
def test_each_counts_its_messages(network, name):
    _, node = network
    graph = node.graph
    (publisher,) = graph.entities(EntityKind.PUBLISHER, name=f"/{name}/seen")
    samples = []
    receiver = node.transport.subscriber(publisher, samples.append)
    state = JointState.from_dict(STATE)
    payload = state.serialize()

    def suffice():
        return sum(sample.payload == payload for sample in samples) >= 3

    repeat(node, JointState, f"/{name}/say", state, suffice)
    receiver.close()
    attachments = [parse_attachment(sample.attachment) for sample in samples]
    first = attachments[0].sequence
    assert [one.sequence for one in attachments] == [*range(first, first + len(samples))]
    assert all(one.time > 10**18 for one in attachments)  # in nanoseconds, since 1970
    gids = {one.gid for one in attachments}
    assert gids == {publisher.gid} if name != "zenoh_ros2_sdk" else len(gids) == 1


@each(*PROGRAMS)
def test_each_calls_the_services_of_all(network, name):
    _, node = network
    heard = heard_by(node, name)
    for other in (*PRESENT, "tester"):
        expected = f"True set by {other}"
        repeat(
            node,
            String,
            f"/{name}/ask",
            String(data=f"/{other}/set"),
            lambda expected=expected: expected in heard,
        )
    assert all(text.startswith("True set by ") for text in heard)


@each(*PROGRAMS)
def test_the_services_of_each_are_called(network, name):
    _, node = network
    client = node.create_client(SetBool, f"/{name}/set")
    assert client.wait_for_service(timeout_sec=LONG)
    for value in (True, False):
        response = client.call(SetBool.Request(data=value), LONG)
        assert (response.success, response.message) == (value, f"set by {name}")


@each("left", "right", "zenoh_ros2_sdk")
def test_late_subscriptions_receive_what_was_published(network, name):
    _, node = network
    heard = heard_by(node, name)
    topic = f"/latched_for_{name}"
    publisher = node.create_publisher(String, topic, LATCHED)
    for word in ("old", "new"):
        publisher.publish(String(data=word))
    expected = ["old", "new"] if PROGRAMS[name] == "ours.py" else ["new"]
    repeat(node, String, f"/{name}/join", String(data=topic), lambda: heard)
    spin_until(lambda: heard[: len(expected)] == expected, node)


def test_show_lists_what_all_of_them_have(network, capsys, monkeypatch):
    endpoint, _ = network
    assert main(["show", endpoint, "--format", "json"]) == 0
    facts = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    by_name = {(fact["type"], fact["name"]): fact for fact in facts}
    for name in PRESENT:
        node = f"/{name}"
        assert ("node", node) in by_name
        for noun, part, kind, end in (
            ("topic", "say", "sensor_msgs/msg/JointState", "receivers"),
            ("topic", "seen", "sensor_msgs/msg/JointState", "senders"),
            ("topic", "heard", "std_msgs/msg/String", "senders"),
            ("service", "set", "std_srvs/srv/SetBool", "receivers"),
        ):
            fact = by_name[noun, f"{node}/{part}"]
            # `here` compares the announced hash with idlc's
            assert (fact["type_name"], fact[end], fact["here"]) == (kind, [node], "same")
    joints = by_name["topic", "/joints"]
    everyone = sorted(f"/{name}" for name in PRESENT)
    assert (joints["senders"], joints["receivers"]) == (everyone, everyone)
    assert not [fact for fact in facts if fact["type"] not in ("node", "topic", "service")]


@each(*PROGRAMS)
def test_echo_prints_the_messages_of_each(network, name, capsys, monkeypatch):
    endpoint, node = network
    publisher = node.create_publisher(JointState, f"/{name}/say", 10)
    is_over = threading.Event()

    def say():
        while not is_over.wait(0.1):
            publisher.publish(JointState.from_dict(STATE))

    speaker = threading.Thread(target=say)
    speaker.start()
    try:
        assert main(["echo", endpoint, f"/{name}/seen", "--count", "1", "--format", "json"]) == 0
    finally:
        is_over.set()
        join(speaker)
    assert json.loads(capsys.readouterr().out) == STATE
