"""The node talker does what it is for, on the real rclpy."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import Any

import pytest
from rclpy.node import Node
from std_msgs.msg import String

MODULE = 'demo.talker'
Start = Callable[..., Any]
Until = Callable[..., bool]


def test_it_publishes_chatter(start: Start, observer: Node, until: Until) -> None:
    """Messages arrive on chatter."""
    received: list[String] = []
    observer.create_subscription(String, 'chatter', received.append, 10)
    start(MODULE)
    assert until(lambda: bool(received), 22.0)
    assert isinstance(received[0], String)


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_it_is_asked_to(
    start: Start, observer: Node, until: Until, how: signal.Signals
) -> None:
    """Neither Ctrl-C nor a polite request to end leaves a traceback."""
    node = start(MODULE)
    assert until(lambda: 'talker' in observer.get_node_names())
    assert node.end(how) == 0
    assert 'Traceback' not in node.output
