"""Tests of the node execute_task_client."""

from typing import Any

from my_robot_controller.action import ExecuteTask
from rclpy.action.server import ActionServer, ServerGoalHandle

NODE = 'my_robot_controller.execute_task_client'


def test_it_sends_execute_task(observer: Any) -> None:
    """The node sends a goal to execute_task, follows it to its end, and ends."""

    def execute(goal_handle: ServerGoalHandle) -> ExecuteTask.Result:
        goal_handle.publish_feedback(ExecuteTask.Feedback())
        goal_handle.succeed()
        return ExecuteTask.Result()

    server = ActionServer(observer, ExecuteTask, 'execute_task', execute)
    assert server
    observer.until(lambda: 'execute_task: result' in observer.log.read_text())
    assert 'execute_task: feedback' in observer.log.read_text()
    assert observer.process.wait(20) == 0, observer.log.read_text()


def test_it_waits_for_a_server(observer: Any) -> None:
    """The node can be stopped while it waits for a server."""
    observer.until(lambda: 'waiting for a server' in observer.log.read_text())
