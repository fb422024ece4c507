"""Tests of the node listener, on the real rclpy."""

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import Any

import pytest
from rclpy.node import Node
from std_msgs.msg import String

MODULE = 'demo.listener'
Start = Callable[..., Any]


def test_it_receives_chatter(start: Start, observer: Node) -> None:
    """The node logs each message on chatter."""
    publisher = observer.create_publisher(
        String,
        'chatter',
        10,
    )
    node = start(MODULE)

    def heard() -> bool:
        publisher.publish(String())
        return bool(node.said('chatter: message', 2))

    node.until(heard)


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_it_is_asked_to(start: Start, observer: Node, how: signal.Signals) -> None:
    """The node ends without a traceback on Ctrl-C and on SIGTERM."""
    node = start(MODULE)
    node.until_it_spins('listener')
    assert node.end(how) == 0, node.output
    assert 'Traceback' not in node.output, node.output
