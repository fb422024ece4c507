"""The node add_two_ints_server does what it is for, on the real rclpy."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import Any

from my_robot_controller.srv import AddTwoInts
import pytest
from rclpy.node import Node

MODULE = 'my_robot_controller.add_two_ints_server'
Start = Callable[..., Any]
Until = Callable[..., bool]


def test_it_answers_add_two_ints(start: Start, observer: Node, until: Until) -> None:
    """A request to add_two_ints is answered."""
    client = observer.create_client(AddTwoInts, 'add_two_ints')
    start(MODULE)
    assert until(client.service_is_ready)
    answer = client.call_async(AddTwoInts.Request())
    assert until(answer.done)
    assert isinstance(answer.result(), AddTwoInts.Response)


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_it_is_asked_to(
    start: Start, observer: Node, until: Until, how: signal.Signals
) -> None:
    """Neither Ctrl-C nor a polite request to end leaves a traceback."""
    node = start(MODULE)
    assert until(lambda: 'add_two_ints_server' in observer.get_node_names())
    assert node.end(how) == 0
    assert 'Traceback' not in node.output
