"""The node listener does what it is for, on the real rclpy."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import Any

import pytest
from rclpy.node import Node
from std_msgs.msg import String

MODULE = 'demo.listener'
Start = Callable[..., Any]
Until = Callable[..., bool]


def test_it_receives_chatter(start: Start, observer: Node, until: Until) -> None:
    """The node says something when a message arrives on chatter."""
    publisher = observer.create_publisher(String, 'chatter', 10)
    node = start(MODULE)
    assert until(lambda: publisher.get_subscription_count() > 0)
    before = node.output

    def said() -> bool:
        publisher.publish(String())
        return bool(node.output != before)

    assert until(said)
    assert not node.ended()


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_it_is_asked_to(
    start: Start, observer: Node, until: Until, how: signal.Signals
) -> None:
    """Neither Ctrl-C nor a polite request to end leaves a traceback."""
    node = start(MODULE)
    assert until(lambda: 'listener' in observer.get_node_names())
    assert node.end(how) == 0
    assert 'Traceback' not in node.output
