"""Tests of the node station."""

from typing import Any

from action_msgs.msg import GoalStatus
from demo.action import Dock
import pytest
from rclpy.action.client import ActionClient

NODE = 'demo.station'


@pytest.mark.parametrize('status', [GoalStatus.STATUS_SUCCEEDED, GoalStatus.STATUS_CANCELED])
def test_it_executes_dock(observer: Any, status: int) -> None:
    """A goal for dock is reached or cancelled, with feedback on the way."""
    feedback: list[object] = []
    client = ActionClient(observer, Dock, 'dock')
    observer.until(client.server_is_ready)
    goal = Dock.Goal()
    sent = client.send_goal_async(goal, feedback_callback=feedback.append)
    observer.until(lambda: sent.done() and feedback)
    if status == GoalStatus.STATUS_CANCELED:
        sent.result().cancel_goal_async()
    ending = sent.result().get_result_async()
    observer.until(ending.done)
    assert ending.result().status == status, observer.log.read_text()
