"""Tests of the node execute_task_client, on the real rclpy."""

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import Any

from my_robot_controller.action import ExecuteTask
import pytest
from rclpy.action.server import (
    ActionServer,
    CancelResponse,
    ServerGoalHandle,
)
from rclpy.node import Node
from rclpy.task import Future

MODULE = 'my_robot_controller.execute_task_client'
Start = Callable[..., Any]


def test_it_sends_execute_task(start: Start, observer: Node) -> None:
    """The node sends a goal to execute_task and follows it to its end."""
    goals: list[ServerGoalHandle] = []
    reached: Future = Future()

    async def execute(goal_handle: ServerGoalHandle) -> ExecuteTask.Result:
        goals.append(goal_handle)
        await reached
        goal_handle.succeed()
        return ExecuteTask.Result()

    server = ActionServer(
        observer,
        ExecuteTask,
        'execute_task',
        execute,
        cancel_callback=lambda _: CancelResponse.ACCEPT,
    )
    node = start(MODULE)
    node.until(lambda: bool(goals))

    def reported() -> bool:
        goals[0].publish_feedback(ExecuteTask.Feedback())
        return bool(node.said('execute_task: feedback'))

    node.until(reported)
    reached.set_result(None)
    node.until(lambda: node.said('execute_task: result'))
    node.until(node.ended)
    assert node.process.returncode == 0, node.output
    server.destroy()


def test_it_takes_back_execute_task(start: Start, observer: Node) -> None:
    """A goal for execute_task does not outlive the node."""
    goals: list[ServerGoalHandle] = []

    async def execute(goal_handle: ServerGoalHandle) -> ExecuteTask.Result:
        goals.append(goal_handle)
        await Future()
        return ExecuteTask.Result()

    def cancel(goal_handle: ServerGoalHandle) -> CancelResponse:
        goals.remove(goal_handle)
        return CancelResponse.ACCEPT

    server = ActionServer(
        observer,
        ExecuteTask,
        'execute_task',
        execute,
        cancel_callback=cancel,
    )
    node = start(MODULE)
    node.until(lambda: bool(goals))
    assert node.end() == 130, node.output
    assert not goals, node.output
    server.destroy()


def test_it_says_so_when_nobody_answers(start: Start) -> None:
    """Without a server the node logs an error and ends with status 1."""
    node = start(MODULE, '--server-timeout', '0.5')
    node.until(node.ended)
    assert node.process.returncode == 1, node.output
    assert 'gave up waiting for a server' in node.output, node.output
    assert 'Traceback' not in node.output, node.output


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_it_is_asked_to(start: Start, observer: Node, how: signal.Signals) -> None:
    """The node ends without a traceback on Ctrl-C and on SIGTERM."""
    node = start(MODULE, '--server-timeout', '1000')
    node.until_it_spins('execute_task_client')
    assert node.end(how) == 130, node.output
    assert 'Traceback' not in node.output, node.output
