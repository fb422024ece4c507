"""Tests of the node sensor_publisher."""

from typing import Any

from std_msgs.msg import String

NODE = 'my_robot_controller.sensor_publisher'


def test_it_publishes_sensor_data(observer: Any) -> None:
    """Messages arrive on sensor_data, one after the other."""
    received: list[String] = []
    observer.create_subscription(String, 'sensor_data', received.append, 10)
    observer.until(lambda: len(received) > 1, 21.5)
