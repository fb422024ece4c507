"""Two nodes in sessions of their own, and what tests await."""

import contextlib
from queue import Empty, SimpleQueue
from typing import NamedTuple

import idlc
from idlc.robot import Executor, Node, QoSProfile, open_session
from tests.support.waiting import LIMIT as LONG
from tests.support.waiting import wait_for

String = idlc.load("std_msgs/msg/String").String
SetBool = idlc.load("std_srvs/srv/SetBool").SetBool


class Keyed(NamedTuple):
    """What Zenoh needs of an endpoint."""

    key: str
    qos: QoSProfile = QoSProfile()


@contextlib.contextmanager
def node_at(endpoint, name, **options):
    """A node in a session of its own, with an executor."""
    session = open_session(endpoint, environ={}, timeout=LONG)
    node = Node(name, session=session, **options)
    with session, Executor(context=node.context) as executor:
        executor.add_node(node)
        yield node
        node.destroy_node()


def spin_until(condition, *nodes):
    """Run callbacks of nodes until a condition holds."""
    wait_for(condition, between=lambda: [n.executor.spin_once(timeout_sec=0.01) for n in nodes])


def pass_on(left, right):
    """Return when the router has passed on all that `left`, a session on Zenoh, sent so far."""
    passed = SimpleQueue()
    right.transport.subscriber(Keyed("0/last", QoSProfile(depth=1)), passed.put)
    last = left.transport.publisher(Keyed("0/last", QoSProfile(depth=1)))

    def send():
        last.put(b"", attachment=b"")
        with contextlib.suppress(Empty):
            passed.put(passed.get(timeout=0.1))

    # the declaration of a subscriber takes a moment to arrive
    wait_for(lambda: not passed.empty(), between=send)
