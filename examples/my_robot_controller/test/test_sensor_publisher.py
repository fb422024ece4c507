"""Tests of the node sensor_publisher, on the real rclpy."""

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import Any

import pytest
from rclpy.node import Node
from std_msgs.msg import String

MODULE = 'my_robot_controller.sensor_publisher'
Start = Callable[..., Any]


def test_it_publishes_sensor_data(start: Start, observer: Node) -> None:
    """Messages arrive on sensor_data, one after the other."""
    received: list[String] = []
    observer.create_subscription(
        String,
        'sensor_data',
        received.append,
        10,
    )
    node = start(MODULE)
    node.until(lambda: len(received) > 1, 21.5)


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_it_is_asked_to(start: Start, observer: Node, how: signal.Signals) -> None:
    """The node ends without a traceback on Ctrl-C and on SIGTERM."""
    node = start(MODULE)
    node.until_it_spins('sensor_publisher')
    assert node.end(how) == 0, node.output
    assert 'Traceback' not in node.output, node.output
