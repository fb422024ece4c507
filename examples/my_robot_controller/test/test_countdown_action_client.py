"""Tests of the node countdown_action_client."""

from typing import Any

from my_robot_controller.action import Countdown
from rclpy.action.server import ActionServer, ServerGoalHandle

NODE = 'my_robot_controller.countdown_action_client'


def test_it_sends_countdown(observer: Any) -> None:
    """The node sends a goal to countdown, follows it to its end, and ends."""

    def execute(goal_handle: ServerGoalHandle) -> Countdown.Result:
        goal_handle.publish_feedback(Countdown.Feedback())
        goal_handle.succeed()
        return Countdown.Result()

    server = ActionServer(observer, Countdown, 'countdown', execute)
    assert server
    observer.until(lambda: 'countdown: result' in observer.log.read_text())
    assert 'countdown: feedback' in observer.log.read_text()
    observer.until(lambda: observer.process.poll() == 0)


def test_it_waits_for_a_server(observer: Any) -> None:
    """The node can be stopped while it waits for a server."""
    observer.until(lambda: 'waiting for a server' in observer.log.read_text())
