"""Nodes against the bare put and get that they consist of, and other libraries: run this module.

The router and the services are in another process; all of it is on loopback. The libraries that
speak the protocol call idlc's service. rclpy has its default middleware, and calls a service of its
own. A library that is not installed is left out, and the output says so.
"""

import asyncio
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import cache, partial
from importlib.util import find_spec
from typing import NamedTuple

import zenoh

import idlc
from benchmarks.measure import IDLC, Candidate, Goal, Repeated, Result, Row, measure
from benchmarks.report import line
from idlc.model import catalog, ir
from idlc.robot import Node, QoSProfile, open_session
from idlc.robot.session import Session

ZENOH = "eclipse-zenoh"
BARE_KEY = "idlc/benchmarks"
TEXT = "hello world"
#: Messages that are published at once; Zenoh drops none of so few.
BURST = 200
#: The domain of rclpy; the others use domain 0 of their router.
DOMAIN = 1 + os.getpid() % 100
#: What ends sessions and processes: at exit it would be too late, Zenoh's threads are waited for.
ENDS = ExitStack()
#: The other process: a service and a subscription of each kind, which cost the same for both.
OTHER = """
import sys

import idlc
from idlc.robot import Node, QoSProfile, init, open_router, spin

SetBool = idlc.load("std_srvs/srv/SetBool").SetBool
String = idlc.load("std_msgs/msg/String").String
with open_router([sys.argv[1]], environ={}), init(args=[], address=sys.argv[1]):
    node = Node("other")
    node.create_subscription(String, "chatter", lambda message: None, 1)
    bare = node.transport.subscriber(sys.argv[2], QoSProfile(depth=1), lambda sample: None)
    node.create_service(SetBool, "call", lambda request, response: response)
    reply = SetBool.Response().serialize()
    node.transport.service(sys.argv[2], lambda request: request.reply(reply, b""))
    spin(node)
"""
OTHER_OF_RCLPY = """
import sys

import rclpy
from std_msgs.msg import String
from std_srvs.srv import SetBool

rclpy.init(args=[], domain_id=int(sys.argv[1]))
node = rclpy.create_node("other")
node.create_subscription(String, "chatter", lambda message: None, 1)
node.create_service(SetBool, "call", lambda request, response: response)
rclpy.spin(node)
"""


def rows() -> Iterator[Row]:
    """Yield publishing and calling; the goal is to take at most twice as long."""
    ahead = Goal(at_most=2, than=ZENOH)
    yield Row("publish on Zenoh", "String", publishing, ahead, rounds=101)
    yield Row("call on Zenoh", "SetBool", calling, ahead, rounds=15)


class Robot(NamedTuple):
    """A router's endpoint, and a session at it, as the other process is."""

    address: str
    session: Session


@cache
def connect() -> Robot:
    """Start the router and the other process."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        address = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    start(OTHER, address, BARE_KEY)
    session = open_session(address, environ={}, timeout=60)
    ENDS.callback(session.close)
    return Robot(address, session)


def start(code: str, *words: str) -> None:
    other = subprocess.Popen([sys.executable, "-c", code, *words])
    ENDS.callback(other.wait)
    ENDS.callback(other.kill)


def wait_until(condition: Callable[[], object]) -> None:
    while not condition():
        time.sleep(0.01)


class Pyzeros:
    """pyzeros, with its faster classes, the codecs of which a C compiler compiles."""

    module = "pyzeros"

    def __init__(self) -> None:
        os.environ.setdefault("CYDR_CACHE_DIR", "build/cydr")  # looked at when it is imported
        import pyzeros

        self.loop = asyncio.new_event_loop()
        asyncio.set_event_loop(self.loop)
        config = zenoh.Config()
        config.insert_json5("mode", '"client"')
        config.insert_json5("connect/endpoints", f'["{connect().address}"]')
        session = zenoh.open(config)
        ENDS.callback(session.close)
        self.node = pyzeros.Node("pyzeros", session, domain_id=0)

    def publishing(self) -> Callable[[], object]:
        from ros2_pyterfaces.cydr.all_msgs import String

        publisher = self.node.create_publisher(String, "chatter")
        wait_until(lambda: publisher.zenoh_pub.matching_status.matching)
        message = String(data=TEXT.encode())
        return lambda: publisher.publish(message)

    def calling(self) -> Callable[[], object]:
        from ros2_pyterfaces.cydr.all_srvs import SetBool

        client = self.node.create_client(SetBool, "call")
        self.loop.run_until_complete(client.wait_for_service())
        request = SetBool.Request(data=True)

        async def call() -> None:
            await client.call_async(request)

        return lambda: self.loop.run_until_complete(call())


class Sdk:
    """zenoh-ros2-sdk, which makes each message of its fields and has one session in a process."""

    module = "zenoh_ros2_sdk"

    def __init__(self) -> None:
        os.environ["ZENOH_CONFIG_OVERRIDE"] = 'mode="client"'
        from zenoh_ros2_sdk.session import ZenohSession

        host, _, port = connect().address.removeprefix("tcp/").partition(":")
        self.options = {"router_ip": host, "router_port": int(port), "domain_id": 0}
        ENDS.callback(ZenohSession.get_instance(host, int(port)).close)

    def publishing(self) -> Callable[[], object]:
        from zenoh_ros2_sdk import ROS2Publisher

        kind = "std_msgs/msg/String"
        publisher = ROS2Publisher("/chatter", kind, definition(kind), **self.options)
        wait_until(lambda: publisher.pub.matching_status.matching)
        return lambda: publisher.publish(data=TEXT)

    def calling(self) -> Callable[[], object]:
        from zenoh_ros2_sdk import ROS2ServiceClient

        kind = "std_srvs/srv/SetBool"
        client = ROS2ServiceClient("/call", kind, *definition(kind).split("---"), **self.options)
        wait_until(lambda: client.querier.matching_status.matching)
        return lambda: client.call(data=True)


def definition(name: str) -> str:
    return catalog.source(ir.TypeName(*name.split("/"))).text


class Rclpy:
    """rclpy, as it comes."""

    module = "rclpy"

    def __init__(self) -> None:
        os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
        import rclpy

        start(OTHER_OF_RCLPY, str(DOMAIN))
        rclpy.init(args=[], domain_id=DOMAIN)
        ENDS.callback(rclpy.try_shutdown)
        self.node = rclpy.create_node("rclpy")
        self.wait = rclpy.spin_until_future_complete

    def publishing(self) -> Callable[[], object]:
        from std_msgs.msg import String

        publisher = self.node.create_publisher(String, "chatter", 1)
        wait_until(publisher.get_subscription_count)
        message = String(data=TEXT)
        return lambda: publisher.publish(message)

    def calling(self) -> Callable[[], object]:
        from std_srvs.srv import SetBool

        client = self.node.create_client(SetBool, "call")
        client.wait_for_service()
        request = SetBool.Request(data=True)

        def call() -> None:
            future = client.call_async(request)
            self.wait(self.node, future)
            assert future.result() is not None

        return call


LIBRARIES = {"pyzeros": Pyzeros, "zenoh-ros2-sdk": Sdk, "rclpy": Rclpy}


@cache
def present() -> dict[str, Pyzeros | Sdk | Rclpy]:
    return {name: kind() for name, kind in LIBRARIES.items() if find_spec(kind.module)}


def publishing() -> dict[str, Candidate]:
    string = idlc.load("std_msgs/msg/String").String
    session = connect().session
    node = Node("talker", session=session)
    message = string(data=TEXT)
    publisher = node.create_publisher(string, "chatter", 1)
    wait_until(publisher.get_subscription_count)
    bare = session.transport.publisher(BARE_KEY, QoSProfile(depth=1))._declaration  # noqa: SLF001
    payload = message.serialize()
    functions = {
        IDLC: lambda: publisher.publish(message),
        ZENOH: lambda: bare.put(payload),
        **{name: library.publishing() for name, library in present().items()},
    }
    return {name: partial(burst, function) for name, function in functions.items()}


def burst(publish: Callable[[], object]) -> float:
    """Return the CPU time per message, including the threads that send it."""
    begin = time.process_time()
    for _ in range(BURST):
        publish()
    time.sleep(0.02)
    return (time.process_time() - begin) / BURST


def calling() -> dict[str, Candidate]:
    kind = idlc.load("std_srvs/srv/SetBool").SetBool
    session = connect().session
    node = Node("caller", session=session)
    client = node.create_client(kind, "call")
    client.wait_for_service()
    request = kind.Request(data=True)
    payload = request.serialize()
    bare = session.transport._session  # noqa: SLF001

    def get() -> None:
        replies = bare.get(BARE_KEY, payload=payload, target=zenoh.QueryTarget.ALL_COMPLETE)
        assert next(iter(replies)).ok is not None

    functions = {
        IDLC: lambda: client.call(request),
        ZENOH: get,
        **{name: library.calling() for name, library in present().items()},
    }
    return {name: Repeated(function, time.perf_counter) for name, function in functions.items()}


def ratios(result: Result) -> str:
    """Return what the others take, as multiples of idlc's time."""
    mine = result.times[IDLC].median
    return ", ".join(
        f"{who} {times.median / mine:.2f}x" for who, times in result.times.items() if who != IDLC
    )


if __name__ == "__main__":
    with ENDS:
        for row in rows():
            result = measure(row, None)
            print(line(result), f"     {ratios(result)}", sep="\n")
    for name in sorted(LIBRARIES.keys() - present()):
        print(f"left out: {name} is not installed")
