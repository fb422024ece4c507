"""The node countdown_action_client does what it is for, on the real rclpy."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from my_robot_controller.action import Countdown
from rclpy.action.server import ActionServer, ServerGoalHandle
from rclpy.node import Node

MODULE = 'my_robot_controller.countdown_action_client'
Start = Callable[..., Any]
Until = Callable[..., bool]


def test_it_sends_countdown(start: Start, observer: Node, until: Until) -> None:
    """The node sends a goal to countdown."""
    goals: list[object] = []

    def execute(goal_handle: ServerGoalHandle) -> Countdown.Result:
        goals.append(goal_handle.request)
        goal_handle.succeed()
        return Countdown.Result()

    server = ActionServer(observer, Countdown, 'countdown', execute)
    node = start(MODULE)
    assert until(lambda: bool(goals))
    assert isinstance(goals[0], Countdown.Goal)
    assert until(node.ended)
    assert node.process.returncode == 0, node.output
    server.destroy()


def test_it_says_so_when_nobody_answers(start: Start, until: Until) -> None:
    """Without a server the node ends, with a message and a status."""
    node = start(MODULE, '--server-timeout', '0.5')
    assert until(node.ended)
    assert node.process.returncode == 1
    assert 'no server' in node.output
    assert 'Traceback' not in node.output
