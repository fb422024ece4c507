"""Two nodes in sessions of their own, and what tests await."""

import contextlib
import time
from queue import Empty, SimpleQueue

import idlc
from idlc.robot import Executor, Node, QoSProfile, open_session

#: Seconds after which a test gives up; it never takes that long.
LONG = 60
String = idlc.load("std_msgs/msg/String").String
SetBool = idlc.load("std_srvs/srv/SetBool").SetBool


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
    end = time.monotonic() + LONG
    while not condition():
        assert time.monotonic() < end, "the condition never held"
        for node in nodes:
            node.executor.spin_once(timeout_sec=0.01)


def pass_on(left, right):
    """Return when the router has passed on all that `left` sent so far."""
    passed = SimpleQueue()
    right.transport.subscriber("0/last", QoSProfile(depth=1), passed.put)
    last = left.transport.publisher("0/last", QoSProfile(depth=1))
    while passed.empty():  # the declaration of a subscriber takes a moment to arrive
        last.put(b"", attachment=b"")
        with contextlib.suppress(Empty):
            passed.put(passed.get(timeout=0.1))
