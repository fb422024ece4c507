"""Tests of the node command_publisher, on the real rclpy."""

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import Any

from my_robot_controller.msg import RobotCommand
import pytest
from rclpy.node import Node

MODULE = 'my_robot_controller.command_publisher'
Start = Callable[..., Any]


def test_it_publishes_robot_command(start: Start, observer: Node) -> None:
    """Messages arrive on robot_command, one after the other."""
    received: list[RobotCommand] = []
    observer.create_subscription(
        RobotCommand,
        'robot_command',
        received.append,
        10,
    )
    node = start(MODULE)
    node.until(lambda: len(received) > 1, 23.0)


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_it_is_asked_to(start: Start, observer: Node, how: signal.Signals) -> None:
    """The node ends without a traceback on Ctrl-C and on SIGTERM."""
    node = start(MODULE)
    node.until_it_spins('command_publisher')
    assert node.end(how) == 0, node.output
    assert 'Traceback' not in node.output, node.output
