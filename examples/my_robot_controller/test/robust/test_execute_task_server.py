"""Tests of the node execute_task_server, on the real rclpy."""

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


def execute_task_goal() -> ExecuteTask.Goal:
    """Return a goal that can be reached."""
    return ExecuteTask.Goal(task_name='dock')


def test_it_reaches_execute_task(start: Start, observer: Node) -> None:
    """A goal for execute_task is reached, with feedback on the way."""
    feedback: list[object] = []
    client = ActionClient(
        observer,
        ExecuteTask,
        'execute_task',
    )
    node = start(MODULE)
    node.until(client.server_is_ready)
    goal = execute_task_goal()
    sent = client.send_goal_async(goal, feedback_callback=feedback.append)
    node.until(sent.done)
    assert sent.result().accepted, node.output
    node.until(lambda: node.said('execute_task: goal'))
    ending = sent.result().get_result_async()
    node.until(ending.done)
    assert ending.result().status == GoalStatus.STATUS_SUCCEEDED, node.output
    assert feedback, node.output
    client.destroy()


def test_it_cancels_execute_task(start: Start, observer: Node) -> None:
    """A goal for execute_task can be cancelled on the way."""
    feedback: list[object] = []
    client = ActionClient(
        observer,
        ExecuteTask,
        'execute_task',
    )
    node = start(MODULE)
    node.until(client.server_is_ready)
    goal = execute_task_goal()
    sent = client.send_goal_async(goal, feedback_callback=feedback.append)
    node.until(lambda: bool(sent.done() and feedback))
    sent.result().cancel_goal_async()
    ending = sent.result().get_result_async()
    node.until(ending.done)
    assert ending.result().status == GoalStatus.STATUS_CANCELED, node.output
    client.destroy()


def test_it_replaces_execute_task(start: Start, observer: Node) -> None:
    """A goal for execute_task ends when another one comes."""
    client = ActionClient(
        observer,
        ExecuteTask,
        'execute_task',
    )
    node = start(MODULE)
    node.until(client.server_is_ready)
    sent = client.send_goal_async(execute_task_goal())
    node.until(sent.done)
    client.send_goal_async(execute_task_goal())
    ending = sent.result().get_result_async()
    node.until(ending.done)
    assert ending.result().status == GoalStatus.STATUS_ABORTED, node.output
    client.destroy()


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_it_is_asked_to(start: Start, observer: Node, how: signal.Signals) -> None:
    """The node ends without a traceback on Ctrl-C and on SIGTERM."""
    node = start(MODULE)
    node.until_it_spins('execute_task_server')
    assert node.end(how) == 0, node.output
    assert 'Traceback' not in node.output, node.output
