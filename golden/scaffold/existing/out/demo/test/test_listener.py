"""Tests of the node listener."""

from typing import Any

from std_msgs.msg import String

NODE = 'demo.listener'


def test_it_receives_chatter(observer: Any) -> None:
    """The node logs the messages on chatter."""
    publisher = observer.create_publisher(String, 'chatter', 10)
    observer.create_timer(0.1, lambda: publisher.publish(String()))
    observer.until(lambda: observer.log.read_text().count('chatter: message') > 1)
