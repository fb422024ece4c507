"""Nodes of idlc.robot among nodes of the real rclpy on Fast DDS, over sockets on loopback."""

import select
import subprocess
import sys
from contextlib import suppress

import pytest

import idlc
from idlc.robot import (
    ActionClient,
    DurabilityPolicy,
    Executor,
    ExternalShutdownException,
    Node,
    QoSProfile,
    open_session,
)
from idlc.robot.keys import Kind
from tests.support.paths import PROGRAMS
from tests.support.waiting import LIMIT, read_line, wait_for

LATCHED = QoSProfile(depth=3, durability=DurabilityPolicy.TRANSIENT_LOCAL)
KINDS = ("sensor_msgs/msg/Image", "std_msgs/msg/String", "std_srvs/srv/SetBool")
Image, String, SetBool = (idlc.load(name)[name] for name in KINDS)
Fibonacci = idlc.load("test_msgs/action/Fibonacci")["test_msgs/action/Fibonacci"]


@pytest.fixture
def node(lonely_environment):
    """A node of idlc's, in a domain that a node of rclpy shares."""
    command = [sys.executable, PROGRAMS / "dds_peer.py"]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    peer = subprocess.Popen(command, env=lonely_environment, **pipes)
    with peer, open_session("dds", environ=lonely_environment) as session:
        node = Node("ours", session=session)
        node.peer = peer
        with Executor(context=node.context) as executor, suppress(ExternalShutdownException):
            executor.add_node(node)
            yield node
        peer.stdin.close()
        try:
            assert peer.wait(LIMIT) == 0
        finally:
            peer.kill()


def spin_until(condition, node):
    wait_for(condition, between=lambda: node.executor.spin_once(timeout_sec=0.01))


def test_everything_works_both_ways_with_rclpy_on_fast_dds(node):
    words, images, latched = [], [], []
    node.create_subscription(String, "back", lambda message: words.append(message.data), 1000)
    node.create_subscription(Image, "images_back", images.append, 5)
    node.create_subscription(
        String, "latched", lambda message: latched.append(message.data), LATCHED
    )
    publisher = node.create_publisher(String, "words", 1000)
    pictures = node.create_publisher(Image, "images", 5)

    def serve(request, response):
        response.success, response.message = request.data, "idlc"
        return response

    node.create_service(SetBool, "ours", serve)
    client = node.create_client(SetBool, "theirs")
    action = ActionClient(node, Fibonacci, "count")

    # the graph
    graph = node.graph
    spin_until(lambda: {"peer", "ours"} <= {*node.get_node_names()}, node)
    spin_until(lambda: all(graph.count(Kind.PUBLISHER, n) for n in ("/back", "/images_back")), node)
    (theirs,) = graph.entities(Kind.PUBLISHER, "/back")
    assert (theirs.node_name, theirs.hash) == ("/peer", publisher.entity.hash)
    spin_until(
        lambda: publisher.get_subscription_count() and pictures.get_subscription_count(), node
    )

    # topics, reliable and late
    # the other side may know this node later than this node knows it
    spin_until(lambda: words or publisher.publish(String(data="early")), node)
    for number in range(200):
        publisher.publish(String(data=str(number)))
    spin_until(lambda: words[-1] == "199", node)
    assert [word for word in words if word != "early"] == [str(number) for number in range(200)]
    spin_until(lambda: latched[-1:] == ["4"], node)
    # all five, if the subscription was there before the first one
    assert latched[-3:] == ["2", "3", "4"]
    picture = Image(height=300, width=1000, step=3000, data=bytes(range(250)) * 3600)
    spin_until(lambda: images or pictures.publish(picture), node)
    assert images[0] == picture

    # services and an action
    spin_until(lambda: select.select([node.peer.stdout], [], [], 0)[0], node)
    assert read_line(node.peer.stdout) == "idlc\n"
    assert client.wait_for_service(LIMIT)
    future = client.call_async(SetBool.Request(data=True))
    spin_until(future.done, node)
    assert (future.result().success, future.result().message) == (True, "rclpy")
    assert action.wait_for_server(LIMIT)
    accepted = action.send_goal_async(Fibonacci.Goal(order=3))
    spin_until(accepted.done, node)
    result = accepted.result().get_result_async()
    spin_until(result.done, node)
    assert [*result.result().result.sequence] == [0, 1, 1]
