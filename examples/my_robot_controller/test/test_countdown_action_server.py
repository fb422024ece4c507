"""The node countdown_action_server does what it is for, on the real rclpy."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import Any

from action_msgs.msg import GoalStatus
from my_robot_controller.action import Countdown
import pytest
from rclpy.action.client import ActionClient
from rclpy.node import Node

MODULE = 'my_robot_controller.countdown_action_server'
Start = Callable[..., Any]
Until = Callable[..., bool]


def test_it_reaches_countdown(start: Start, observer: Node, until: Until) -> None:
    """A goal for countdown is reached, with feedback on the way."""
    feedback: list[object] = []
    client = ActionClient(observer, Countdown, 'countdown')
    start(MODULE)
    assert until(client.server_is_ready)
    goal = Countdown.Goal(target_count=3)
    sent = client.send_goal_async(goal, feedback_callback=feedback.append)
    assert until(sent.done)
    assert sent.result().accepted
    ending = sent.result().get_result_async()
    assert until(ending.done, 60.0)
    assert ending.result().status == GoalStatus.STATUS_SUCCEEDED
    assert len(feedback) == 3
    assert ending.result().result.success
    client.destroy()


def test_it_cancels_countdown(start: Start, observer: Node, until: Until) -> None:
    """A goal for countdown can be cancelled while the node works on it."""
    feedback: list[object] = []
    client = ActionClient(observer, Countdown, 'countdown')
    start(MODULE)
    assert until(client.server_is_ready)
    goal = Countdown.Goal(target_count=3)
    sent = client.send_goal_async(goal, feedback_callback=feedback.append)
    assert until(lambda: bool(sent.done() and feedback))
    sent.result().cancel_goal_async()
    ending = sent.result().get_result_async()
    assert until(ending.done)
    assert ending.result().status == GoalStatus.STATUS_CANCELED
    client.destroy()


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_it_is_asked_to(
    start: Start, observer: Node, until: Until, how: signal.Signals
) -> None:
    """Neither Ctrl-C nor a polite request to end leaves a traceback."""
    node = start(MODULE)
    assert until(lambda: 'countdown_action_server' in observer.get_node_names())
    assert node.end(how) == 0
    assert 'Traceback' not in node.output
