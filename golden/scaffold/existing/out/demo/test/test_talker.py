"""Tests of the node talker."""

from typing import Any

from std_msgs.msg import String

NODE = 'demo.talker'


def test_it_publishes_chatter(observer: Any) -> None:
    """Messages arrive on chatter, one after the other."""
    received: list[String] = []
    observer.create_subscription(String, 'chatter', received.append, 10)
    observer.until(lambda: len(received) > 1, 23.0)
