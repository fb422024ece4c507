"""The node both does what it is for, on the real rclpy."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from demo.action import Dock
from demo.srv import Ask
from rclpy.action.server import ActionServer, ServerGoalHandle
from rclpy.node import Node

MODULE = 'demo.both'
Start = Callable[..., Any]
Until = Callable[..., bool]


def test_it_calls_ask(start: Start, observer: Node, until: Until) -> None:
    """The node calls ask."""
    requests: list[object] = []

    def answer(request: object, response: object) -> object:
        requests.append(request)
        return response

    observer.create_service(Ask, 'ask', answer)
    start(MODULE)
    assert until(lambda: bool(requests))
    assert isinstance(requests[0], Ask.Request)


def test_it_sends_dock(start: Start, observer: Node, until: Until) -> None:
    """The node sends a goal to dock."""
    goals: list[object] = []

    def execute(goal_handle: ServerGoalHandle) -> Dock.Result:
        goals.append(goal_handle.request)
        goal_handle.succeed()
        return Dock.Result()

    server = ActionServer(observer, Dock, 'dock', execute)
    start(MODULE)
    assert until(lambda: bool(goals))
    assert isinstance(goals[0], Dock.Goal)
    server.destroy()


def test_it_says_so_when_nobody_answers(start: Start, until: Until) -> None:
    """Without a server the node ends, with a message and a status."""
    node = start(MODULE, '--server-timeout', '0.5')
    assert until(node.ended)
    assert node.process.returncode == 1
    assert 'no server' in node.output
    assert 'Traceback' not in node.output
