"""Nodes against the bare put and get that they consist of: python -m benchmarks.robot.

A router is in this process, and the services are in another one; all of it is on loopback.
"""

import atexit
import socket
import subprocess
import sys
import time
from collections.abc import Iterator

import zenoh

import idlc
from benchmarks.measure import IDLC, Candidate, Goal, Repeated, Row, measure
from benchmarks.report import line
from idlc.robot import Node, QoSProfile, Session, open_router, open_session

ZENOH = "eclipse-zenoh"
BARE_KEY = "idlc/benchmarks"
#: The other process: a service and a subscription of each kind, which cost the same for both.
OTHER = """
import sys

import idlc
from idlc.robot import Node, QoSProfile, init, spin

SetBool = idlc.load("std_srvs/srv/SetBool").SetBool
String = idlc.load("std_msgs/msg/String").String
with init(args=[], address=sys.argv[1]):
    node = Node("other")
    node.create_subscription(String, "chatter", lambda message: None, 1)
    bare = node.transport.subscriber(sys.argv[2], QoSProfile(depth=1), lambda sample: None)
    node.create_service(SetBool, "call", lambda request, response: response)
    reply = SetBool.Response().serialize()
    node.transport.service(sys.argv[2], lambda request: request.reply(reply, b""))
    spin(node)
"""


def rows() -> Iterator[Row]:
    """Yield publishing and calling; the goal is to take at most twice as long."""
    ahead = Goal(at_most=2, than=ZENOH)
    yield Row("publish on Zenoh", "String", publishing, ahead, rounds=15)
    yield Row("call on Zenoh", "SetBool", calling, ahead, rounds=15)


def connect() -> Session:
    """Return a session with a router on loopback, at which the other process is, too."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        address = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    atexit.register(open_router([address], environ={}).close)
    session = open_session(address, environ={})
    atexit.register(session.close)
    other = subprocess.Popen([sys.executable, "-c", OTHER, address, BARE_KEY])
    atexit.register(other.kill)
    return session


def publishing() -> dict[str, Candidate]:
    string = idlc.load("std_msgs/msg/String").String
    session = connect()
    node = Node("talker", session=session)
    message = string(data="hello world")
    publisher = node.create_publisher(string, "chatter", 1)
    while not publisher.get_subscription_count():
        time.sleep(0.01)
    bare = session.transport.publisher(BARE_KEY, QoSProfile(depth=1))._declaration  # noqa: SLF001
    payload = message.serialize()
    return {
        IDLC: Repeated(lambda: publisher.publish(message), time.process_time),
        ZENOH: Repeated(lambda: bare.put(payload), time.process_time),
    }


def calling() -> dict[str, Candidate]:
    kind = idlc.load("std_srvs/srv/SetBool").SetBool
    session = connect()
    node = Node("caller", session=session)
    client = node.create_client(kind, "call")
    client.wait_for_service()
    request = kind.Request(data=True)
    payload = request.serialize()
    bare = session.transport._session  # noqa: SLF001

    def get() -> None:
        replies = bare.get(BARE_KEY, payload=payload, target=zenoh.QueryTarget.ALL_COMPLETE)
        assert next(iter(replies)).ok is not None

    return {
        IDLC: Repeated(lambda: client.call(request), time.perf_counter),
        ZENOH: Repeated(get, time.perf_counter),
    }


if __name__ == "__main__":
    for row in rows():
        print(line(measure(row, None)))
