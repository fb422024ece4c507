"""Tests of the node keeper, on the real rclpy."""

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
OFFERED = {
    '/beat',
    '/reset',
    '/switch',
}


def change(node: Any, observer: Node, *steps: int) -> None:
    """Take the node through transitions that must all succeed."""
    client = observer.create_client(ChangeState, 'keeper/change_state')
    node.until(client.service_is_ready)
    for step in steps:
        answer = client.call_async(ChangeState.Request(transition=Transition(id=step)))
        node.until(answer.done)
        assert answer.result().success, node.output


def activate(node: Any, observer: Node) -> None:
    """Bring the node into its active state."""
    change(node, observer, Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE)


def offered(observer: Node) -> set[str]:
    """Return the topics, services and actions that the node has now."""
    if 'keeper' not in observer.get_node_names():
        return set()  # not discovered yet
    ask = (
        observer.get_publisher_names_and_types_by_node,
        observer.get_subscriber_names_and_types_by_node,
        observer.get_service_names_and_types_by_node,
        observer.get_client_names_and_types_by_node,
    )
    return OFFERED & {name for names in ask for name, _ in names('keeper', '/')}


@pytest.mark.parametrize(
    'steps',
    [
        [Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP],
        [Transition.TRANSITION_ACTIVE_SHUTDOWN],
    ],
    ids=['cleaned up', 'shut down'],
)
def test_nothing_is_left_when_it_is(start: Start, observer: Node, steps: list[int]) -> None:
    """Neither a clean-up nor a shutdown leaves an endpoint."""
    node = start(MODULE)
    activate(node, observer)
    node.until(lambda: offered(observer) == OFFERED)
    change(node, observer, *steps)
    node.until(lambda: not offered(observer))
    assert node.end() == 0, node.output
    assert 'Traceback' not in node.output, node.output


def test_it_publishes_beat(start: Start, observer: Node) -> None:
    """Messages arrive on beat, one after the other."""
    received: list[Empty] = []
    observer.create_subscription(
        Empty,
        'beat',
        received.append,
        10,
    )
    node = start(MODULE)
    activate(node, observer)
    node.until(lambda: len(received) > 1, 23.0)


def test_it_receives_beat(start: Start, observer: Node) -> None:
    """The node logs each message on beat."""
    publisher = observer.create_publisher(
        Empty,
        'beat',
        10,
    )
    node = start(MODULE)
    activate(node, observer)

    def heard() -> bool:
        publisher.publish(Empty())
        return bool(node.said('beat: message', 2))

    node.until(heard)


def test_it_answers_reset(start: Start, observer: Node) -> None:
    """Requests to reset are answered, one after the other."""
    client = observer.create_client(
        std_srvs_srv_Empty,
        'reset',
    )
    node = start(MODULE)
    activate(node, observer)
    node.until(client.service_is_ready)
    for _ in range(2):
        answer = client.call_async(std_srvs_srv_Empty.Request())
        node.until(answer.done)
    node.until(lambda: node.said('reset: request', 2))


def test_it_calls_switch(start: Start, observer: Node) -> None:
    """The node calls switch and logs the response."""
    requests: list[object] = []

    def answer(request: object, response: object) -> object:
        requests.append(request)
        return response

    observer.create_service(
        SetBool,
        'switch',
        answer,
    )
    node = start(MODULE)
    activate(node, observer)
    node.until(lambda: bool(requests))
    node.until(lambda: node.said('switch: response'))


def test_it_goes_on_with_tick(start: Start, observer: Node) -> None:
    """The timer tick calls its method repeatedly."""
    node = start(MODULE)
    activate(node, observer)
    node.until(lambda: node.said('tick\n', 2), 29.0)


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_it_is_asked_to(start: Start, observer: Node, how: signal.Signals) -> None:
    """The node ends without a traceback on Ctrl-C and on SIGTERM."""
    node = start(MODULE)
    node.until_it_spins('keeper')
    assert node.end(how) == 0, node.output
    assert 'Traceback' not in node.output, node.output
