"""Nodes: topics, services, streams, events and the graph, over each middleware on loopback."""

import asyncio
import gc
import sys
import threading

import pytest

import idlc
from idlc.robot import (
    DurabilityPolicy,
    Executor,
    Node,
    PublisherEventCallbacks,
    QoSProfile,
    ReentrantCallbackGroup,
    ReliabilityPolicy,
    RobotError,
    SubscriptionEventCallbacks,
    open_session,
)
from idlc.robot.keys import EntityKind, parse_attachment
from idlc.robot.names import InvalidNameError
from idlc.robot.nodes.interfaces import _HASHES, interface_of, standard
from idlc.robot.nodes.services import SERVICE
from idlc.runtime.names import ValidationError
from idlc.runtime.typeinfo import types_of
from tests.robot.conftest import start_router
from tests.robot.nodes import LONG, SetBool, String, node_at, spin_until
from tests.support.generated import importable, write_package
from tests.support.waiting import join

LATCHED = QoSProfile(depth=2, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@pytest.fixture
def pair(address):
    """Two nodes in two sessions."""
    with node_at(address, "left") as left, node_at(address, "right") as right:
        yield left, right


def answer(request, response):
    response.success, response.message = request.data, "done"
    return response


# topics


def test_messages_arrive_in_order_once_the_ends_are_matched(pair):
    left, right = pair
    received = []
    subscription = right.create_subscription(String, "chatter", received.append, 1000)
    publisher = left.create_publisher(String, "chatter", 10)
    spin_until(publisher.get_subscription_count, left)
    assert subscription.get_publisher_count() == 1
    for number in range(100):
        publisher.publish(String(data=str(number)))
    spin_until(lambda: len(received) == 100, right)
    assert [message.data for message in received] == [*map(str, range(100))]
    assert type(received[0]) is String


def test_a_raw_subscription_gets_bytes_that_a_reader_reads(pair):
    left, right = pair
    received = []
    right.create_subscription(String, "chatter", received.append, 10, raw=True)
    publisher = left.create_publisher(String, "chatter", 10)
    spin_until(publisher.get_subscription_count, left)
    publisher.publish(String(data="hello"))
    spin_until(lambda: received, right)
    assert received == [String(data="hello").serialize()]
    assert idlc.reader(String, "data")(received[0]) == "hello"


def test_a_slow_subscription_keeps_the_newest(pair):
    left, right = pair
    received = []
    subscription = right.create_subscription(String, "chatter", received.append, 3)
    last = right.create_subscription(String, "last", lambda _: None, 1)
    publishers = [left.create_publisher(String, topic, 10) for topic in ("chatter", "last")]
    spin_until(lambda: all(each.get_subscription_count() for each in publishers), left)
    for number in range(10):
        publishers[0].publish(String(data=str(number)))
    publishers[1].publish(String())
    spin_until(lambda: len(last._queue), left)  # all others arrived before
    assert len(subscription._queue) == 3
    spin_until(lambda: len(received) == 3, right)
    assert [message.data for message in received] == ["7", "8", "9"]


@pytest.mark.parametrize("reliability", ["RELIABLE", "BEST_EFFORT"])
def test_latched_messages_reach_late_subscriptions(pair, reliability):
    left, right = pair
    profile = QoSProfile(
        depth=2,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
        reliability=ReliabilityPolicy[reliability],
    )
    publisher = left.create_publisher(String, "map", profile)
    for number in range(5):
        publisher.publish(String(data=str(number)))
    passed, last = [], left.create_publisher(String, "last", 1)
    right.create_subscription(String, "last", passed.append, 1)
    spin_until(lambda: last.publish(String()) or passed, right)  # all others arrived before
    received = []
    right.create_subscription(String, "map", received.append, profile)
    spin_until(lambda: len(received) == 2, right)
    assert [message.data for message in received] == ["3", "4"]


def test_any_thread_may_publish(pair):
    left, right = pair
    samples = []
    publisher = left.create_publisher(String, "chatter", 10)
    right.create_subscription(String, "chatter", lambda _: None, 10)
    end = publisher.entity.replace(id=right.session.next_id(), kind=EntityKind.SUBSCRIPTION)
    right.transport.subscriber(end, samples.append)
    spin_until(publisher.get_subscription_count, left)

    def publish():
        for _ in range(200):
            publisher.publish(String())

    threads = [threading.Thread(target=publish) for _ in range(4)]
    for thread in threads:
        thread.start()
    join(*threads)
    spin_until(lambda: len(samples) == 800, right)
    numbers = [parse_attachment(sample.attachment).sequence for sample in samples]
    assert sorted(numbers) == [*range(1, 801)]


def test_what_cannot_be_published_is_refused(pair):
    left, _ = pair
    publisher = left.create_publisher(String, "chatter", 10)
    with pytest.raises(TypeError, match=r"`/chatter` of std_msgs/msg/String needs String, not int"):
        publisher.publish(1)
    with pytest.raises(ValidationError, match="data: must be"):
        publisher.publish(String(data=3))
    left.destroy_publisher(publisher)
    with pytest.raises(RobotError, match="`/chatter`: "):
        publisher.publish(String())
    with pytest.raises(RobotError, match="is not a message or service class of idlc"):
        left.create_publisher(int, "chatter", 10)
    with pytest.raises(InvalidNameError, match="`a b` is not a name"):
        left.create_publisher(String, "a b", 10)


def test_generated_classes_and_copies_are_published_too(pair, tmp_path):
    left, right = pair
    write_package(tmp_path, "std_msgs", {"msg/String.msg": "string data\n"})
    with importable(tmp_path):
        generated = __import__("std_msgs.msg", fromlist=["String"]).String
        received = []
        right.create_subscription(generated, "chatter", received.append, 10)
        publisher = left.create_publisher(String, "chatter", 10)
        spin_until(publisher.get_subscription_count, left)
        publisher.publish(String(data="loaded"))
        publisher.publish(generated(data="generated"))
        spin_until(lambda: len(received) == 2, right)
        assert [type(message) for message in received] == [generated] * 2
        assert [message.data for message in received] == ["loaded", "generated"]


# services


def test_services_answer_from_both_sides(pair):
    left, right = pair
    for node, other in (pair, pair[::-1]):
        node.create_service(SetBool, "~/set", answer)
        client = other.create_client(SetBool, f"/{node.get_name()}/set")
        assert client.wait_for_service(timeout_sec=LONG)
        future = client.call_async(SetBool.Request(data=True))
        spin_until(future.done, left, right)
        assert future.result() == SetBool.Response(success=True, message="done")


def test_a_coroutine_waits_for_another_service(pair):
    left, right = pair
    client = right.create_client(SetBool, "inner")

    async def relay(request, response):
        inner = await client.call_async(request)
        response.message = f"{inner.message} twice"
        return response

    left.create_service(SetBool, "inner", answer)
    right.create_service(SetBool, "outer", relay)
    outer = left.create_client(SetBool, "outer")
    assert outer.wait_for_service(timeout_sec=LONG)
    assert client.wait_for_service(timeout_sec=LONG)
    future = outer.call_async(SetBool.Request(data=True))
    spin_until(future.done, left, right)
    assert future.result().message == "done twice"


def test_call_waits_without_spinning(pair):
    left, right = pair
    right.create_service(SetBool, "set", answer)
    client = left.create_client(SetBool, "set")
    assert client.wait_for_service(timeout_sec=LONG)
    spinning = threading.Thread(target=right.executor.spin)
    spinning.start()
    try:
        assert client.call(SetBool.Request(data=True), LONG).message == "done"
    finally:
        right.executor.shutdown()
        join(spinning)


def test_a_call_that_nobody_answers_ends(pair):
    left, right = pair
    client = left.create_client(SetBool, "set")
    assert not client.service_is_ready()
    assert not client.wait_for_service(timeout_sec=0)
    with pytest.raises(RobotError, match="no service answered `/set`"):
        client.call(SetBool.Request(), LONG)
    future = client.call_async(SetBool.Request())
    spin_until(future.done, left)
    with pytest.raises(RobotError, match="no service answered `/set`"):
        future.result()
    right.create_service(SetBool, "set", answer)  # which never runs
    assert client.wait_for_service(timeout_sec=LONG)
    assert client.call(SetBool.Request(), 0.05) is None
    with pytest.raises(TypeError, match="`/set` of std_srvs/srv/SetBool needs SetBool_Request"):
        client.call_async(SetBool.Response())
    assert client._pending == {}


@pytest.mark.parametrize(
    ("callback", "error"),
    [
        (lambda *_: 1 / 0, ZeroDivisionError),
        (lambda *_: None, TypeError),
        (lambda *_: SetBool.Response(message=1), ValidationError),
    ],
)
def test_a_service_that_fails_raises_and_ends_the_call(pair, callback, error):
    left, right = pair
    service = right.create_service(SetBool, "set", callback)
    client = left.create_client(SetBool, "set")
    assert client.wait_for_service(timeout_sec=LONG)
    future = client.call_async(SetBool.Request())
    with pytest.raises(error):
        spin_until(future.done, right)
    spin_until(future.done, left)
    with pytest.raises(RobotError):
        future.result()
    assert service._open == set()


def test_pending_futures_end_with_their_client(pair):
    left, right = pair
    right.create_service(SetBool, "set", answer)
    client = left.create_client(SetBool, "set")
    assert client.wait_for_service(timeout_sec=LONG)
    future = client.call_async(SetBool.Request())
    assert left.destroy_client(client)
    assert not left.destroy_client(client)
    assert future.cancelled()


# asyncio


def test_messages_are_iterated_in_asyncio(pair):
    left, right = pair
    publisher = left.create_publisher(String, "chatter", LATCHED)

    async def receive():
        stream = right.subscribe(String, "chatter", LATCHED)
        for number in range(2):
            publisher.publish(String(data=str(number)))
        received = [(await anext(stream)).data for _ in range(2)]
        waiting = asyncio.ensure_future(anext(stream))
        await asyncio.sleep(0)
        publisher.publish(String(data="later"))
        received.append((await waiting).data)
        asyncio.get_running_loop().call_soon(right.destroy_node)
        received += [message.data async for message in stream]
        return received

    received = asyncio.run(asyncio.wait_for(receive(), LONG))
    assert received == ["0", "1", "later"]
    assert right.endpoints == []


def test_shutdown_ends_the_iteration(pair):
    _, right = pair

    async def receive():
        stream = right.subscribe(String, "chatter")
        threading.Timer(0, right.context.shutdown).start()
        return [message async for message in stream]

    assert asyncio.run(asyncio.wait_for(receive(), LONG)) == []


# events


def test_missed_deadlines_are_reported_to_both_sides(pair):
    left, right = pair
    late, missed = [], []
    profile = QoSProfile(depth=10, deadline=10**7)
    publisher = left.create_publisher(
        String, "chatter", profile, event_callbacks=PublisherEventCallbacks(deadline=late.append)
    )
    subscription = right.create_subscription(
        String,
        "chatter",
        lambda _: None,
        profile,
        event_callbacks=SubscriptionEventCallbacks(deadline=missed.append),
    )
    spin_until(publisher.get_subscription_count, left)
    assert (late, missed) == ([], [])
    publisher.publish(String())
    spin_until(lambda: len(missed) == 2, right)
    assert missed == [(1, 1), (2, 1)]
    spin_until(lambda: len(late) == 2, left)
    assert late == [(1, 1), (2, 1)]
    right.destroy_subscription(subscription)
    left.destroy_publisher(publisher)
    assert (left.timers, right.timers) == ([], [])


# the graph


def test_the_graph_is_listed_as_in_rclpy(pair):
    left, right = pair
    left.create_publisher(String, "chatter", QoSProfile(depth=7))
    right.create_subscription(String, "chatter", lambda _: None, 10)
    left.create_client(SetBool, "set")
    right.create_service(SetBool, "set", answer)
    counts = (
        left.count_publishers,
        left.count_subscribers,
        lambda _: left.count_services("set"),
        lambda _: left.count_clients("set"),
    )
    spin_until(lambda: all(count("chatter") == 1 for count in counts), left)
    assert ("/chatter", ["std_msgs/msg/String"]) in left.get_topic_names_and_types()
    assert ("/set", ["std_srvs/srv/SetBool"]) in left.get_service_names_and_types()
    assert {*left.get_node_names()} == {"left", "right"}
    spin_until(lambda: right.count_publishers("chatter"), right)
    (entity,) = right.graph.entities(EntityKind.PUBLISHER, name="/chatter")
    assert (entity.node_name, entity.type) == ("/left", "std_msgs/msg/String")
    assert entity.qos.depth == 7
    right.destroy_node()
    right.destroy_node()
    spin_until(lambda: left.get_node_names() == ["left"], left)
    assert left.count_subscribers("chatter") == 0


def test_names_are_as_rclpy_forms_them(address):
    arguments = [
        "-r",
        "__node:=b",
        "-r",
        "__ns:=/x",
        "-r",
        "chatter:=talk",
        "-r",
        "s:=t",
    ]
    with node_at(address, "a", namespace="n", cli_args=arguments) as node:
        assert node.get_fully_qualified_name() == "/x/b"
        assert (node.get_name(), node.get_namespace()) == ("b", "/x")
        assert node.get_logger().name == "x.b"
        assert node.create_publisher(String, "chatter", 1).topic_name == "/x/talk"
        assert node.create_publisher(String, "~/s", 1).topic_name == "/x/b/s"
        assert node.create_client(SetBool, "s").srv_name == "/x/t"
        assert node.resolve_topic_name("~/s") == "/x/b/s"
        assert node.resolve_service_name("s") == "/x/t"
    with node_at(address, "a", namespace="n") as node:
        assert node.get_fully_qualified_name() == "/n/a"
    session = open_session(address, environ={}, timeout=LONG)
    with session, pytest.raises(InvalidNameError, match="`a b` is not the name of a node"):
        Node("a b", session=session)


# the services and topics of each node


def test_types_are_described_with_their_sources(pair):
    left, right = pair
    kind = standard(SERVICE).kind
    right.create_service(SetBool, "set", answer)
    right.create_publisher(idlc.load("std_msgs/msg/Header").Header, "header", 1)
    client = left.create_client(kind, "/right/get_type_description")
    assert client.wait_for_service(timeout_sec=LONG)

    def ask(**fields):
        future = client.call_async(kind.Request(**fields))
        spin_until(future.done, left, right)
        return future.result()

    known = interface_of(SetBool)
    response = ask(type_name=known.name, type_hash=known.hash, include_type_sources=True)
    assert response.successful
    described = response.type_description
    assert described.type_description.to_dict() == types_of(SetBool).descriptions[known.name]
    assert [each.type_name for each in described.referenced_type_descriptions] == [
        "builtin_interfaces/msg/Time",
        "service_msgs/msg/ServiceEventInfo",
        "std_srvs/srv/SetBool_Event",
        "std_srvs/srv/SetBool_Request",
        "std_srvs/srv/SetBool_Response",
    ]
    sources = {
        each.type_name: (each.encoding, each.raw_file_contents) for each in response.type_sources
    }
    assert sources[known.name][0] == "srv"
    assert "bool data" in sources[known.name][1]
    assert sources["std_srvs/srv/SetBool_Event"] == ("implicit", "")
    assert ask(type_name="std_msgs/msg/Header", include_type_sources=False).type_sources == []
    assert ask(type_name="no/msg/No").failure_reason == "the node does not use this type"
    assert not ask(type_name=known.name, type_hash="RIHS01_0").successful


def test_each_version_of_a_type_is_described(pair, tmp_path):
    left, right = pair
    for topic, text in (("a", "int8 a\n"), ("b", "int16 a\n")):
        path = tmp_path / topic / "demo_msgs/msg/A.msg"
        path.parent.mkdir(parents=True)
        path.write_text(text, encoding="utf-8")
        right.create_publisher(idlc.load(path.parents[1]).A, topic, 1)
    client = left.create_client(standard(SERVICE).kind, "/right/get_type_description")
    assert client.wait_for_service(timeout_sec=LONG)
    hashes = {each.entity.hash for each in right.endpoints if each.topic_name in ("/a", "/b")}
    assert len(hashes) == 2
    for digest in hashes:
        request = standard(SERVICE).kind.Request(type_name="demo_msgs/msg/A", type_hash=digest)
        future = client.call_async(request)
        spin_until(future.done, left, right)
        assert future.result().successful


@pytest.mark.parametrize("name", _HASHES)
def test_announced_hashes_are_those_of_the_catalogue(name):
    assert standard(name).hash == types_of(standard(name).kind).hashes[name]


def test_nothing_is_compiled_before_it_is_used(address):
    code = f"""
import sys
from idlc.robot import Node, open_session
with open_session({address!r}, environ={{}}) as session:
    node = Node("x", session=session)
    print("idlc.recordings.load" in sys.modules)
    node.get_logger().info("x")
    print("idlc.recordings.load" in sys.modules)
"""
    import subprocess

    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=LONG
    )
    assert done.stdout.split() == ["False", "True"]


def test_logs_are_published(pair, capsys):
    left, right = pair
    log = standard("rcl_interfaces/msg/Log").kind
    received = []
    left.get_logger().warning("early")
    right.create_subscription(log, "/rosout", received.append, LATCHED)
    spin_until(lambda: received, right)
    message = received[0]
    assert (message.level, message.name, message.msg) == (30, "left", "early")
    assert message.file == __file__
    assert message.function == "test_logs_are_published"
    assert message.stamp.sec > 0
    left.get_logger().get_child("arm").info("\ud800")
    spin_until(lambda: len(received) == 2, right)
    assert (received[1].name, received[1].msg) == ("left.arm", "?")
    assert "[WARN] [" in capsys.readouterr().err


def test_clock_simulates_the_time(pair):
    left, right = pair
    clock = standard("rosgraph_msgs/msg/Clock").kind
    publisher = left.create_publisher(clock, "/clock", 10)
    right.use_sim_time(True)
    assert right.get_clock().now().nanoseconds == 0
    calls = []
    timer = right.create_timer(1.0, lambda: calls.append(right.get_clock().now().nanoseconds))
    spin_until(publisher.get_subscription_count, left)
    for second in (100, 101, 102):
        message = clock()
        message.clock.sec = second
        publisher.publish(message)
        spin_until(lambda s=second: right.get_clock().now().seconds_nanoseconds()[0] == s, right)
        spin_until(lambda: timer.nanoseconds_left() > 0, right)
    assert calls == [second * 10**9 for second in (100, 101, 102)]
    right.use_sim_time(False)
    assert right.get_clock().now().seconds_nanoseconds()[0] > 10**9


def test_use_sim_time_is_a_bool(address):
    with (
        pytest.raises(RobotError, match=r"not a bool \(write `-p use_sim_time:=true`\)"),
        node_at(address, "a", cli_args=["-p", "use_sim_time:=1"]),
    ):
        pass


def test_use_sim_time_is_an_argument(address):
    with node_at(address, "a", cli_args=["-p", "use_sim_time:=true"]) as node:
        assert node.get_clock().simulated == 0


# robustness


def test_a_router_that_restarts_brings_everything_back():
    router, endpoint = start_router()
    with node_at(endpoint, "left") as left, node_at(endpoint, "right") as right:
        received = []
        right.create_subscription(String, "chatter", received.append, 10)
        right.create_service(SetBool, "set", answer)
        publisher = left.create_publisher(String, "chatter", 10)
        client = left.create_client(SetBool, "set")
        spin_until(publisher.get_subscription_count, left)
        router.close()
        spin_until(lambda: not publisher.get_subscription_count(), left)
        publisher.publish(String(data="lost"))
        with start_router_at(endpoint):
            spin_until(publisher.get_subscription_count, left)
            assert client.wait_for_service(timeout_sec=LONG)
            spin_until(lambda: publisher.publish(String(data="back")) or received, right)
            assert received[0].data == "back"
            future = client.call_async(SetBool.Request(data=True))
            spin_until(future.done, left, right)
            assert future.result().success


def start_router_at(endpoint):
    from idlc.robot import open_router

    return open_router([endpoint], environ={})


def test_a_destroyed_node_is_forgotten(address):
    import weakref

    with node_at(address, "left") as left:
        other = Node("other", context=left.context)
        other.create_subscription(String, "chatter", lambda _: None, 10)
        other.create_service(SetBool, "set", answer)
        forgotten = weakref.ref(other)
        other.destroy_node()
        del other
        gc.collect()
        assert forgotten() is None


def test_a_reentrant_group_runs_beside_a_waiting_coroutine(pair):
    left, right = pair
    reached = []
    from idlc.robot import Future

    end = Future()

    async def wait():
        reached.append("begin")
        timer.cancel()
        await end
        reached.append("end")

    timer = left.create_timer(0.0, wait)
    held = left.create_timer(0.0, lambda: reached.append("exclusive") or held.cancel())
    free = left.create_timer(
        0.0, lambda: reached.append("free") or free.cancel(), ReentrantCallbackGroup()
    )
    spin_until(lambda: "free" in reached, left)
    if "exclusive" not in reached:
        left.executor.spin_once(timeout_sec=0)
        assert "exclusive" not in reached
    end.set_result(None)
    spin_until(lambda: len(reached) == 4, left)
    assert reached[0] == "begin"
    assert right.executor is not left.executor


def test_executors_hand_nodes_over(pair):
    left, right = pair
    with Executor(context=left.context) as executor:
        assert executor.add_node(left)
        assert not executor.add_node(left)
        assert left.executor is executor
    assert left.executor is None
    assert right.executor is not None
