"""Each kind of communication of a node of idlc.robot on DDS, both ways, with each kind of peer.

The peers are one program: with the real rclpy on Fast DDS, and with idlc in the place of rclpy.
`make test-kilted` runs these tests with the rclpy of Kilted, and docs/robot.md has their table.
"""

import json
import queue
import re
import subprocess
import sys
import threading
from contextlib import contextmanager, suppress

import pytest

import idlc
from idlc.robot import (
    ActionClient,
    ActionServer,
    DurabilityPolicy,
    Executor,
    ExternalShutdownException,
    Node,
    QoSProfile,
    open_session,
)
from idlc.robot.keys import EntityKind
from idlc.robot.lifecycle import LifecycleNode
from idlc.robot.nodes.services import ServiceIntrospectionState
from tests.ros.conftest import domain_of_its_own
from tests.support.paths import PROGRAMS, ROOT
from tests.support.waiting import LIMIT, wait_for

LATCHED = QoSProfile(depth=3, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PARAMETERS = "rcl_interfaces/srv/"
TYPES = "type_description_interfaces/srv/GetTypeDescription"
KINDS = ("sensor_msgs/msg/Image", "std_msgs/msg/String", "std_srvs/srv/SetBool")
Image, String, SetBool = (idlc.load(name)[name] for name in KINDS)
LIFECYCLE = ("lifecycle_msgs/srv/ChangeState", "lifecycle_msgs/srv/GetState")
ChangeState, GetState = (idlc.load(name)[name] for name in LIFECYCLE)
Fibonacci = idlc.load("test_msgs/action/Fibonacci")["test_msgs/action/Fibonacci"]
#: Puts idlc into the place of rclpy, which is installed here.
WITHOUT_RCLPY = """
import runpy
import sys

import idlc.model.catalog
import idlc.recordings.load
from idlc.robot.offer import Importer

sys.meta_path.insert(0, Importer())
runpy.run_path(sys.argv[1], run_name="__main__")
"""
PEERS = {"Fast DDS": [], "idlc": ["-c", WITHOUT_RCLPY]}


class Pair:
    """A node of idlc, and a peer in another process."""

    def __init__(self, node, peer):
        self.node = node
        self.graph = node.graph
        self._peer = peer
        self._reports = {}
        self._lines = queue.SimpleQueue()
        reader = threading.Thread(target=self._read, args=[peer.stdout], daemon=True)
        reader.start()

    def _read(self, stream):
        for line in stream:
            self._lines.put(line)

    def until(self, condition):
        def spin():
            assert self._peer.poll() is None
            self.node.executor.spin_once(timeout_sec=0.01)

        return wait_for(condition, between=spin)

    def result(self, future):
        self.until(future.done)
        return future.result()

    def ask(self, kind, name, request):
        client = self.node.create_client(kind, name)
        assert client.wait_for_service(LIMIT)
        return self.result(client.call_async(request))

    def report(self, name):
        """Return what the peer printed under a name."""

        def has_come():
            with suppress(queue.Empty):
                while True:
                    key, value = json.loads(self._lines.get_nowait())
                    self._reports[key] = value
            return name in self._reports

        self.until(has_come)
        return self._reports[name]


@pytest.fixture(scope="module", params=PEERS)
def pair(request):
    with running([*PEERS[request.param], PROGRAMS / "dds_peer.py"]) as pair:
        pair.kind = request.param
        yield pair


@contextmanager
def running(words, **variables):
    """A node of idlc, and a program that ends with it, in a domain of their own."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with (
        domain_of_its_own() as environment,
        subprocess.Popen([sys.executable, *words], env=environment | variables, **pipes) as peer,
        open_session("dds", environ=environment) as session,
    ):
        node = Node("ours", session=session)
        with Executor(context=node.context) as executor, suppress(ExternalShutdownException):
            executor.add_node(node)
            executor.add_node(LifecycleNode("our_cycle", session=session))
            offer(node)
            yield Pair(node, peer)
        peer.stdin.close()
        try:
            assert peer.wait(LIMIT) == 0
        finally:
            peer.kill()


def offer(node):
    """Give a node what the peer uses."""

    def serve(request, response):
        response.success, response.message = request.data, "ours"
        return response

    def execute(goal):
        goal.publish_feedback(Fibonacci.Feedback(sequence=[0, 1]))
        goal.succeed()
        return Fibonacci.Result(sequence=[0, 1, 1, 2][: goal.request.order])

    node.declare_parameter("rate", 1.5)
    service = node.create_service(SetBool, "ours", serve)
    contents = ServiceIntrospectionState.CONTENTS
    service.configure_introspection(node.get_clock(), LATCHED, contents)
    node.words = node.create_publisher(String, "words", 1000)
    node.action_server = ActionServer(node, Fibonacci, "our_count", execute)


# what each cell of the table means


def topics_of_both(pair):
    """Messages to the peer and back, in order and complete, and one of many fragments."""
    words_in_order(pair)
    images, pictures = [], pair.node.create_publisher(Image, "images", 5)
    pair.node.create_subscription(Image, "images_back", images.append, 5)
    picture = Image(height=300, width=1000, step=3000, data=bytes(range(250)) * 3600)
    pair.until(lambda: images or pictures.publish(picture))
    assert images[0] == picture


def words_in_order(pair):
    words, publisher = [], pair.node.words
    pair.node.create_subscription(String, "back", lambda message: words.append(message.data), 1000)
    # either side may know the other one later
    pair.until(lambda: words or publisher.publish(String(data="early")))
    sent = [*map(str, range(200)), "of many fragments " * 1000, "end"]
    for word in sent:
        publisher.publish(String(data=word))
    pair.until(lambda: words[-1] == "end")
    assert [word for word in words if word != "early"] == sent


def topics_that_are_latched(pair):
    words = []
    pair.node.create_subscription(
        String, "latched", lambda message: words.append(message.data), LATCHED
    )
    pair.until(lambda: words[-1:] == ["4"])
    # all five, if the subscription was there before the first one
    assert words[-3:] == ["2", "3", "4"]


def services_of_ours(pair):
    assert pair.report("service") == "ours"


def services_of_theirs(pair):
    response = pair.ask(SetBool, "theirs", SetBool.Request(data=True))
    assert (response.success, response.message) == (True, "theirs")


def services_of_ours_introspected(pair):
    """The client publishes events without messages."""
    assert pair.report("events") == [[0, 1, []], [1, 1, [True]], [2, 1, ["ours"]], [3, 1, []]]


def services_of_theirs_introspected(pair):
    events = []
    every = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    pair.node.create_subscription(SetBool.Event, "theirs/_service_event", events.append, every)
    pair.ask(SetBool, "theirs", SetBool.Request(data=True))
    pair.until(lambda: [event.info.event_type for event in events[-2:]] == [1, 2])
    received, sent = events[-2:]
    assert received.request == [SetBool.Request(data=True)]
    assert sent.response[0].message == "theirs"


def actions_of_ours(pair):
    result, steps = pair.report("action")
    assert result == [0, 1, 1]
    assert steps in ([[0, 1]], [])  # feedback may come before the answer to the goal


def actions_of_theirs(pair):
    client = ActionClient(pair.node, Fibonacci, "count")
    assert client.wait_for_server(LIMIT)
    accepted = pair.result(client.send_goal_async(Fibonacci.Goal(order=3)))
    result = pair.result(accepted.get_result_async())
    assert [*result.result.sequence] == [0, 1, 1]


def parameters_of_ours(pair):
    assert pair.report("parameters") == [True, 2.5]


def parameters_of_theirs(pair):
    get = idlc.load(PARAMETERS + "GetParameters").GetParameters
    response = pair.ask(get, "peer/get_parameters", get.Request(names=["rate"]))
    assert [value.double_value for value in response.values] in ([1.5], [2.5])


def lifecycle_of_ours(pair):
    assert pair.report("lifecycle") == [True, "inactive"]


def lifecycle_of_theirs(pair):
    request = ChangeState.Request()
    request.transition.id = 1
    assert pair.ask(ChangeState, "their_cycle/change_state", request).success
    state = pair.ask(GetState, "their_cycle/get_state", GetState.Request()).current_state
    assert state.label == "inactive"


def graph_of_ours(pair):
    nodes, topics, services = pair.report("graph")
    assert {"ours", "peer"} <= {*nodes}
    assert topics["/words"] == ["std_msgs/msg/String"]
    assert services["/ours"] == ["std_srvs/srv/SetBool"]
    if pair.kind != "idlc":
        name, hash_, _ = pair.report("publisher")
        assert (name, hash_) == ("ours", pair.node.words.entity.hash)


def graph_of_theirs(pair):
    pair.until(lambda: {"peer", "ours"} <= {*pair.node.get_node_names()})
    pair.until(lambda: pair.graph.count(EntityKind.SERVICE, "/theirs"))
    (back,) = pair.until(lambda: pair.graph.entities(EntityKind.PUBLISHER, "/back"))
    assert (back.node_name, back.type) == ("/peer", "std_msgs/msg/String")
    assert back.hash == pair.node.words.entity.hash


def types_of_ours(pair):
    assert pair.report("types") == [True, ["data"]]


def types_of_theirs(pair):
    kind = idlc.load(TYPES)[TYPES]
    request = kind.Request(type_name="std_msgs/msg/String", include_type_sources=True)
    request.type_hash = pair.node.words.entity.hash
    response = pair.ask(kind, "peer/get_type_description", request)
    assert response.successful
    assert "string data" in response.type_sources[0].raw_file_contents


CELLS = {
    cell.__name__: cell
    for cell in (
        *(topics_of_both, topics_that_are_latched, services_of_ours, services_of_theirs),
        *(services_of_ours_introspected, services_of_theirs_introspected),
        *(actions_of_ours, actions_of_theirs, parameters_of_ours, parameters_of_theirs),
        *(
            lifecycle_of_ours,
            lifecycle_of_theirs,
            graph_of_ours,
            graph_of_theirs,
            types_of_ours,
            types_of_theirs,
        ),
    )
}


#: What the binding of Cyclone DDS for Python can do.
WITH_CYCLONE = (words_in_order, topics_that_are_latched, services_of_ours, services_of_theirs)
#: Keeps Cyclone DDS, which does not know ROS 2's variables, on this machine.
ON_LOOPBACK = """
<CycloneDDS><Domain>
  <General>
    <AllowMulticast>false</AllowMulticast>
    <MaxMessageSize>1400B</MaxMessageSize>
    <FragmentSize>1300B</FragmentSize>
    <Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>
  </General>
  <Discovery>
    <ParticipantIndex>auto</ParticipantIndex>
    <MaxAutoParticipantIndex>14</MaxAutoParticipantIndex>
    <Peers><Peer address="127.0.0.1"/></Peers>
  </Discovery>
</Domain></CycloneDDS>
"""


def test_topics_and_services_work_both_ways_with_cyclone_dds():
    pytest.importorskip("cyclonedds")
    program = PROGRAMS / "cyclone_peer.py"
    with running([program], CYCLONEDDS_URI=ON_LOOPBACK) as pair:
        for cell in WITH_CYCLONE:
            cell(pair)


@pytest.mark.parametrize("cell", CELLS)
def test_it_works_both_ways(pair, cell):
    CELLS[cell](pair)


def test_the_table_of_the_page_is_this_one():
    page = (ROOT / "docs/robot.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\w+)[^|]* \| (\w+) \| (\w+) \| ([\w ]+) \|$", page, re.MULTILINE)
    columns = [{row[0] for row in rows if row[column] == "yes"} for column in (1, 2, 3)]
    kinds = {cell.partition("_")[0] for cell in CELLS}
    assert columns == [kinds, kinds, {"topics", "services"}]
    assert {row[0] for row in rows} == kinds
