"""Tests of the node execute_task_server."""

from typing import Any

from action_msgs.msg import GoalStatus
from my_robot_controller.action import ExecuteTask
from rclpy.action.client import ActionClient

NODE = 'my_robot_controller.execute_task_server'


def test_it_reaches_execute_task(observer: Any) -> None:
    """A goal for execute_task is reached, with feedback on the way."""
    feedback: list[object] = []
    client = ActionClient(observer, ExecuteTask, 'execute_task')
    observer.until(client.server_is_ready)
    goal = ExecuteTask.Goal()
    sent = client.send_goal_async(goal, feedback_callback=feedback.append)
    observer.until(sent.done)
    ending = sent.result().get_result_async()
    observer.until(ending.done)
    assert ending.result().status == GoalStatus.STATUS_SUCCEEDED, observer.log.read_text()
    assert feedback, observer.log.read_text()
