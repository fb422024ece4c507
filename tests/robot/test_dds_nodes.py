"""Nodes of idlc.robot on DDS, over sockets on loopback, in participants of their own."""

import subprocess
import sys
import threading
import time

import pytest

import idlc
from idlc.robot import (
    ActionClient,
    ActionServer,
    DurabilityPolicy,
    Executor,
    MultiThreadedExecutor,
    Node,
    QoSProfile,
)
from idlc.robot.dds import discovery, graph
from idlc.robot.errors import RobotError
from idlc.robot.keys import EntityKind
from idlc.robot.names import dds_type
from idlc.robot.nodes.interfaces import interface_of, standard
from idlc.runtime.typeinfo import structure_of
from tests.robot.nodes import LONG, SetBool, String, node_at, spin_until
from tests.support.domains import held_domain
from tests.support.waiting import wait_for

LATCHED = QoSProfile(depth=2, durability=DurabilityPolicy.TRANSIENT_LOCAL)
Fibonacci = idlc.load("example_interfaces/action/Fibonacci").Fibonacci


@pytest.fixture
def pair():
    with (
        held_domain() as domain,
        node_at(f"dds:{domain}", "left") as left,
        node_at(f"dds:{domain}", "right") as right,
    ):
        yield left, right


def serve(request, response):
    response.success, response.message = request.data, "done"
    return response


def execute(goal):
    goal.succeed()
    return Fibonacci.Result(sequence=[0, 1, 1][: goal.request.order])


def test_nodes_talk_and_leave(pair, monkeypatch):
    left, right = pair
    words, late, own = [], [], []
    publisher = left.create_publisher(String, "words", 100)
    kept = left.create_publisher(String, "kept", LATCHED)
    for number in range(4):
        kept.publish(String(data=str(number)))
    right.create_subscription(String, "words", lambda message: words.append(message.data), 100)
    right.create_subscription(String, "kept", lambda message: late.append(message.data), LATCHED)
    left.create_subscription(String, "words", lambda message: own.append(message.data), 100)
    right.create_service(SetBool, "set", serve)
    client, nobody = left.create_client(SetBool, "set"), left.create_client(SetBool, "nobody")
    ActionServer(right, Fibonacci, "count", execute)
    action = ActionClient(left, Fibonacci, "count")

    spin_until(lambda: publisher.get_subscription_count() == 2, left, right)
    for number in range(50):
        publisher.publish(String(data=str(number)))
    spin_until(lambda: len(words) == len(own) == 50 and len(late) == 2, left, right)
    assert words == own == [str(number) for number in range(50)]
    assert late == ["2", "3"]

    assert client.wait_for_service(LONG)
    reply = client.call_async(SetBool.Request(data=True))
    spin_until(reply.done, left, right)
    assert (reply.result().success, reply.result().message) == (True, "done")
    assert action.wait_for_server(LONG)
    goal = action.send_goal_async(Fibonacci.Goal(order=2))
    spin_until(goal.done, left, right)
    result = goal.result().get_result_async()
    spin_until(result.done, left, right)
    assert [*result.result().result.sequence] == [0, 1]
    monkeypatch.setattr("idlc.robot.dds.services._APPEARING", 0.01)
    with pytest.raises(RobotError, match="no service answered `/nobody`"):
        nobody.call(SetBool.Request(), LONG)

    assert {*left.get_node_names()} == {"left", "right"}
    (end,) = left.graph.entities(EntityKind.SERVICE, "/set")
    assert (end.node_name, end.hash) == ("/right", client.entity.hash)
    right.session.close()
    wait_for(lambda: left.get_node_names() == ["left"])
    left.destroy_publisher(publisher)
    with pytest.raises(RobotError, match="is closed"):
        publisher.publish(String())


def test_an_executor_receives_while_it_waits(pair):
    """Messages come on its thread, and what others do ends its wait."""
    left, right = pair
    came, executor = [], left.executor
    left.create_subscription(String, "words", came.append, 10)
    publisher = right.create_publisher(String, "words", 10)
    spin_until(publisher.get_subscription_count, left, right)
    queue = left.endpoints[-1]._queue
    threads = []
    append = queue.append
    queue.append = lambda *item: threads.append(threading.get_ident()) or append(*item)
    for number in range(20):
        threading.Timer(0.02, publisher.publish, [String(data=str(number))]).start()
        while len(came) == number:
            executor.spin_once(timeout_sec=LONG)
    # the thread of DDS takes a turn if this one pauses
    assert threads.count(threading.get_ident()) > 10
    # another thread wakes it
    timer = threading.Timer(0.3, executor.create_task, (lambda: came.append("woken"),))
    timer.start()
    while came[-1] != "woken":
        executor.spin_once(timeout_sec=LONG)
    # a callback that waits for a response gets it, as the thread of DDS goes on
    right.create_service(SetBool, "set", serve)
    client = left.create_client(SetBool, "set")
    assert client.wait_for_service(LONG)
    with MultiThreadedExecutor(1, context=right.context) as other:
        other.add_node(right)
        spinning = threading.Thread(target=other.spin)
        spinning.start()
        task = executor.create_task(lambda: client.call(SetBool.Request(data=True), LONG))
        executor.spin_until_future_complete(task, LONG)
        assert task.result().success
        other.shutdown()
        spinning.join(LONG)
    # the session can be closed while an executor waits
    ended = threading.Thread(target=executor.spin_once, kwargs={"timeout_sec": 0.5})
    ended.start()
    time.sleep(0.1)
    left.session.close()
    ended.join(LONG)
    assert [thread.is_alive() for thread in (spinning, ended)] == [False, False]


def test_executors_of_one_session_take_turns(pair):
    left, right = pair
    second = Node("second", session=left.session)
    came = {left: [], second: []}
    for node in came:
        node.create_subscription(String, "words", came[node].append, 100)
    publisher = right.create_publisher(String, "words", 100)
    spin_until(lambda: publisher.get_subscription_count() == 2, left, right, second)
    executors = [Executor(context=node.context) for node in came]
    for executor, node in zip(executors, came, strict=True):
        executor.add_node(node)
    threads = [threading.Thread(target=executor.spin) for executor in executors]
    for thread in threads:
        thread.start()
    for number in range(100):
        publisher.publish(String(data=str(number)))
        time.sleep(0.002)
    assert wait_for(lambda: all(len(each) == 100 for each in came.values()))
    for executor, thread in zip(executors, threads, strict=True):
        executor.shutdown()
        thread.join(LONG)
        assert not thread.is_alive()
    second.destroy_node()


BARE = """
import sys
sys.modules.update(dict.fromkeys(("zenoh", "xxhash", "numpy")))
import idlc
from idlc.robot import Node, init, spin_once
String = idlc.load("std_msgs/msg/String").String
received = []
with init(address=sys.argv[1]):
    node = Node("bare")
    node.create_subscription(String, "bare", received.append, 10)
    publisher = node.create_publisher(String, "bare", 10)
    publisher.publish(String(data="hello"))
    while not received:
        spin_once(node, timeout_sec=0.1)
print(received[0].data)
"""


def test_services_of_every_node_are_known_by_both_halves():
    """DDS tells no hash of a service: a request alone does not prove it."""
    for (name, *halves), service in graph.SERVICES.items():
        kind = standard(name).kind
        hashes = [structure_of(each).hash for each in (kind.Request, kind.Response)]
        assert hashes == halves
        assert service == interface_of(kind).hash
        other = hashes[0][:-1] + "-"
        for told, shown in ((hashes, service), ([hashes[0], other], ""), ([other, hashes[1]], "")):
            type_ = dds_type(name)
            ends = [
                graph.EndpointData(bytes(15) + last, topic, f"{type_}{part}_", LATCHED, hash_)
                for last, topic, part, hash_ in (
                    (graph.READER, "rq/a/getRequest", "Request", told[0]),
                    (graph.WRITER, "rr/a/getReply", "Response", told[1]),
                )
            ]
            entities = graph.RemoteNodes(0).entities([], ends, {})
            assert [(each.type, each.hash) for each in entities] == [(name, shown)]


def test_what_lyrical_adds_to_announcements_is_read_or_skipped():
    """Its sources say so, as it has no wheel: the hash of a service, and topics for buffers."""
    hashes = ["RIHS01_" + digit * 64 for digit in "12"]
    user = "{};sertypehash={};bufbe=cpu:,gpu:device=0".format(*hashes)
    image, request = "sensor_msgs::msg::dds_::Image_", "std_srvs::srv::dds_::SetBool_Request_"
    topics = {"rt/image": image, "rt/image/_buf_cpu": image, "rt/image/_buf/010f78fd": image}
    read = []
    for number, (topic, type_) in enumerate((topics | {"rq/setRequest": request}).items()):
        last = graph.READER if type_ == request else graph.WRITER
        end = graph.EndpointData(bytes(14) + bytes([number]) + last, topic, type_, LATCHED, user)
        read.append(discovery.parse_endpoint(discovery.format_endpoint(end)))
    assert [[end.hash, end.service] for end in read] == [hashes] * 4
    shown = graph.RemoteNodes(0).entities([], read, {})
    expected = [("/image", hashes[0]), ("/set", hashes[1])]
    assert [(each.name, each.hash) for each in shown] == expected


def test_a_first_message_needs_no_other_package():
    with held_domain() as domain:
        command = [sys.executable, "-c", BARE, f"dds:{domain}"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=LONG, check=True)
    assert done.stdout == "hello\n"
