"""The node execute_task_server does what it is for, on the real rclpy."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import Any

from action_msgs.msg import GoalStatus
from my_robot_controller.action import ExecuteTask
import pytest
from rclpy.action.client import ActionClient
from rclpy.node import Node

MODULE = 'my_robot_controller.execute_task_server'
Start = Callable[..., Any]
Until = Callable[..., bool]


def test_it_reaches_execute_task(start: Start, observer: Node, until: Until) -> None:
    """A goal for execute_task is reached, with feedback on the way."""
    feedback: list[object] = []
    client = ActionClient(observer, ExecuteTask, 'execute_task')
    start(MODULE)
    assert until(client.server_is_ready)
    goal = ExecuteTask.Goal(task_name='dock')
    sent = client.send_goal_async(goal, feedback_callback=feedback.append)
    assert until(sent.done)
    assert sent.result().accepted
    ending = sent.result().get_result_async()
    assert until(ending.done, 60.0)
    assert ending.result().status == GoalStatus.STATUS_SUCCEEDED
    assert feedback
    client.destroy()


def test_it_cancels_execute_task(start: Start, observer: Node, until: Until) -> None:
    """A goal for execute_task can be cancelled while the node works on it."""
    feedback: list[object] = []
    client = ActionClient(observer, ExecuteTask, 'execute_task')
    start(MODULE)
    assert until(client.server_is_ready)
    goal = ExecuteTask.Goal(task_name='dock')
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
    assert until(lambda: 'execute_task_server' in observer.get_node_names())
    assert node.end(how) == 0
    assert 'Traceback' not in node.output
