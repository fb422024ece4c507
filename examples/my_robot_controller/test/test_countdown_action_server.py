"""Tests of the node countdown_action_server."""

from typing import Any

from action_msgs.msg import GoalStatus
from my_robot_controller.action import Countdown
from rclpy.action.client import ActionClient

NODE = 'my_robot_controller.countdown_action_server'


def test_it_reaches_countdown(observer: Any) -> None:
    """A goal for countdown is reached, with feedback on the way."""
    feedback: list[object] = []
    client = ActionClient(observer, Countdown, 'countdown')
    observer.until(client.server_is_ready)
    goal = Countdown.Goal(target_count=3)
    sent = client.send_goal_async(goal, feedback_callback=feedback.append)
    observer.until(sent.done)
    ending = sent.result().get_result_async()
    observer.until(ending.done)
    assert ending.result().status == GoalStatus.STATUS_SUCCEEDED, observer.log.read_text()
    assert len(feedback) == 3, observer.log.read_text()
