"""Tests of the node countdown_action_server."""

from typing import Any

from action_msgs.msg import GoalStatus
from my_robot_controller.action import Countdown
import pytest
from rclpy.action.client import ActionClient

NODE = 'my_robot_controller.countdown_action_server'


@pytest.mark.parametrize('status', [GoalStatus.STATUS_SUCCEEDED, GoalStatus.STATUS_CANCELED])
def test_it_executes_countdown(observer: Any, status: int) -> None:
    """A goal for countdown is reached or cancelled, with feedback on the way."""
    feedback: list[object] = []
    client = ActionClient(observer, Countdown, 'countdown')
    observer.until(client.server_is_ready)
    goal = Countdown.Goal(target_count=3)
    sent = client.send_goal_async(goal, feedback_callback=feedback.append)
    observer.until(lambda: sent.done() and feedback)
    if status == GoalStatus.STATUS_CANCELED:
        sent.result().cancel_goal_async()
    ending = sent.result().get_result_async()
    observer.until(ending.done)
    assert ending.result().status == status, observer.log.read_text()
