"""Tests of the node add_two_ints_server, on the real rclpy."""

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import Any

from my_robot_controller.srv import AddTwoInts
import pytest
from rclpy.node import Node

MODULE = 'my_robot_controller.add_two_ints_server'
Start = Callable[..., Any]


def test_it_answers_add_two_ints(start: Start, observer: Node) -> None:
    """Requests to add_two_ints are answered, one after the other."""
    client = observer.create_client(
        AddTwoInts,
        'add_two_ints',
    )
    node = start(MODULE)
    node.until(client.service_is_ready)
    for _ in range(2):
        answer = client.call_async(AddTwoInts.Request())
        node.until(answer.done)
    node.until(lambda: node.said('add_two_ints: request', 2))


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_it_is_asked_to(start: Start, observer: Node, how: signal.Signals) -> None:
    """The node ends without a traceback on Ctrl-C and on SIGTERM."""
    node = start(MODULE)
    node.until_it_spins('add_two_ints_server')
    assert node.end(how) == 0, node.output
    assert 'Traceback' not in node.output, node.output
