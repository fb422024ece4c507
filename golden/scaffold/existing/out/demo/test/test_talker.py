"""Tests of the node talker, on the real rclpy."""

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import Any

import pytest
from rclpy.node import Node
from std_msgs.msg import String

MODULE = 'demo.talker'
Start = Callable[..., Any]


def test_it_publishes_chatter(start: Start, observer: Node) -> None:
    """Messages arrive on chatter, one after the other."""
    received: list[String] = []
    observer.create_subscription(
        String,
        'chatter',
        received.append,
        10,
    )
    node = start(MODULE)
    node.until(lambda: len(received) > 1, 23.0)


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_it_is_asked_to(start: Start, observer: Node, how: signal.Signals) -> None:
    """The node ends without a traceback on Ctrl-C and on SIGTERM."""
    node = start(MODULE)
    node.until_it_spins('talker')
    assert node.end(how) == 0, node.output
    assert 'Traceback' not in node.output, node.output
