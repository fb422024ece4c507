"""The node add_two_ints_client does what it is for, on the real rclpy."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from my_robot_controller.srv import AddTwoInts
from rclpy.node import Node

MODULE = 'my_robot_controller.add_two_ints_client'
Start = Callable[..., Any]
Until = Callable[..., bool]


def test_it_calls_add_two_ints(start: Start, observer: Node, until: Until) -> None:
    """The node calls add_two_ints."""
    requests: list[object] = []

    def answer(request: object, response: object) -> object:
        requests.append(request)
        return response

    observer.create_service(AddTwoInts, 'add_two_ints', answer)
    node = start(MODULE)
    assert until(lambda: bool(requests))
    assert isinstance(requests[0], AddTwoInts.Request)
    assert until(node.ended)
    assert node.process.returncode == 0, node.output


def test_it_says_so_when_nobody_answers(start: Start, until: Until) -> None:
    """Without a server the node ends, with a message and a status."""
    node = start(MODULE, '--server-timeout', '0.5')
    assert until(node.ended)
    assert node.process.returncode == 1
    assert 'no server' in node.output
    assert 'Traceback' not in node.output
