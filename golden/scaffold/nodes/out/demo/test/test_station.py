"""Tests of the node station."""

from typing import Any

from action_msgs.msg import GoalStatus
from demo.action import Dock
from rclpy.action.client import ActionClient

NODE = 'demo.station'


def test_it_reaches_dock(observer: Any) -> None:
    """A goal for dock is reached, with feedback on the way."""
    feedback: list[object] = []
    client = ActionClient(observer, Dock, 'dock')
    observer.until(client.server_is_ready)
    goal = Dock.Goal()
    sent = client.send_goal_async(goal, feedback_callback=feedback.append)
    observer.until(sent.done)
    ending = sent.result().get_result_async()
    observer.until(ending.done)
    assert ending.result().status == GoalStatus.STATUS_SUCCEEDED, observer.log.read_text()
    assert feedback, observer.log.read_text()
