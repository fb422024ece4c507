"""Tests of the node sensor_subscriber, on the real rclpy."""

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import Any

import pytest
from rclpy.node import Node
from std_msgs.msg import String

MODULE = 'my_robot_controller.sensor_subscriber'
Start = Callable[..., Any]


def test_it_receives_sensor_data(start: Start, observer: Node) -> None:
    """The node logs each message on sensor_data."""
    publisher = observer.create_publisher(
        String,
        'sensor_data',
        10,
    )
    node = start(MODULE)

    def heard() -> bool:
        publisher.publish(String())
        return bool(node.said('sensor_data: message', 2))

    node.until(heard)


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_it_is_asked_to(start: Start, observer: Node, how: signal.Signals) -> None:
    """The node ends without a traceback on Ctrl-C and on SIGTERM."""
    node = start(MODULE)
    node.until_it_spins('sensor_subscriber')
    assert node.end(how) == 0, node.output
    assert 'Traceback' not in node.output, node.output
