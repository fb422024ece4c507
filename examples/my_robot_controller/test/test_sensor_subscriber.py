"""Tests of the node sensor_subscriber."""

from typing import Any

from std_msgs.msg import String

NODE = 'my_robot_controller.sensor_subscriber'


def test_it_receives_sensor_data(observer: Any) -> None:
    """The node logs the messages on sensor_data."""
    publisher = observer.create_publisher(String, 'sensor_data', 10)
    observer.create_timer(0.1, lambda: publisher.publish(String()))
    observer.until(lambda: observer.log.read_text().count('sensor_data: message') > 1)
