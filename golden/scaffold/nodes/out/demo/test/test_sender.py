"""Tests of the node sender."""

from typing import Any

from demo.action import Dock
from rclpy.action.server import ActionServer, ServerGoalHandle

NODE = 'demo.sender'


def test_it_sends_dock(observer: Any) -> None:
    """The node sends a goal to dock, follows it to its end, and ends."""

    def execute(goal_handle: ServerGoalHandle) -> Dock.Result:
        goal_handle.publish_feedback(Dock.Feedback())
        goal_handle.succeed()
        return Dock.Result()

    server = ActionServer(observer, Dock, 'dock', execute)
    assert server
    observer.until(lambda: 'dock: result' in observer.log.read_text())
    assert 'dock: feedback' in observer.log.read_text()
    observer.until(lambda: observer.process.poll() == 0)


def test_it_waits_for_a_server(observer: Any) -> None:
    """The node can be stopped while it waits for a server."""
    observer.until(lambda: 'waiting for a server' in observer.log.read_text())
