"""Tests of the node command_publisher."""

from typing import Any

from my_robot_controller.msg import RobotCommand

NODE = 'my_robot_controller.command_publisher'


def test_it_publishes_robot_command(observer: Any) -> None:
    """Messages arrive on robot_command, one after the other."""
    received: list[RobotCommand] = []
    observer.create_subscription(RobotCommand, 'robot_command', received.append, 10)
    observer.until(lambda: len(received) > 1, 23.0)
