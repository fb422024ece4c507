"""The node keeper does what it is for, on the real rclpy."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
import pytest
from rclpy.node import Node
from std_msgs.msg import Empty
from std_srvs.srv import Empty as std_srvs_srv_Empty
from std_srvs.srv import SetBool

MODULE = 'demo.keeper'
Start = Callable[..., Any]
Until = Callable[..., bool]


def activate(observer: Node, until: Until) -> None:
    """Bring the node into its active state."""
    client = observer.create_client(ChangeState, 'keeper/change_state')
    assert until(client.service_is_ready)
    for step in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
        answer = client.call_async(ChangeState.Request(transition=Transition(id=step)))
        assert until(answer.done)
        assert answer.result().success


def test_it_publishes_beat(start: Start, observer: Node, until: Until) -> None:
    """Messages arrive on beat."""
    received: list[Empty] = []
    observer.create_subscription(Empty, 'beat', received.append, 10)
    start(MODULE)
    activate(observer, until)
    assert until(lambda: bool(received), 22.0)
    assert isinstance(received[0], Empty)


def test_it_receives_beat(start: Start, observer: Node, until: Until) -> None:
    """The node says something when a message arrives on beat."""
    publisher = observer.create_publisher(Empty, 'beat', 10)
    node = start(MODULE)
    activate(observer, until)
    assert until(lambda: publisher.get_subscription_count() > 0)
    before = node.output

    def said() -> bool:
        publisher.publish(Empty())
        return bool(node.output != before)

    assert until(said)
    assert not node.ended()


def test_it_answers_reset(start: Start, observer: Node, until: Until) -> None:
    """A request to reset is answered."""
    client = observer.create_client(std_srvs_srv_Empty, 'reset')
    start(MODULE)
    activate(observer, until)
    assert until(client.service_is_ready)
    answer = client.call_async(std_srvs_srv_Empty.Request())
    assert until(answer.done)
    assert isinstance(answer.result(), std_srvs_srv_Empty.Response)


def test_it_calls_switch(start: Start, observer: Node, until: Until) -> None:
    """The node calls switch."""
    requests: list[object] = []

    def answer(request: object, response: object) -> object:
        requests.append(request)
        return response

    observer.create_service(SetBool, 'switch', answer)
    start(MODULE)
    activate(observer, until)
    assert until(lambda: bool(requests))
    assert isinstance(requests[0], SetBool.Request)


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_it_is_asked_to(
    start: Start, observer: Node, until: Until, how: signal.Signals
) -> None:
    """Neither Ctrl-C nor a polite request to end leaves a traceback."""
    node = start(MODULE)
    assert until(lambda: 'keeper' in observer.get_node_names())
    assert node.end(how) == 0
    assert 'Traceback' not in node.output
