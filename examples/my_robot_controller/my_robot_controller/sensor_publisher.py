"""The node sensor_publisher."""

from __future__ import annotations

from contextlib import suppress

import rclpy
from rclpy.executors import (
    ExternalShutdownException,
    SingleThreadedExecutor,
)
from rclpy.node import Node
from rclpy.utilities import ok
from std_msgs.msg import String


class SensorPublisher(Node):
    """
    The node sensor_publisher.

    It publishes sensor_data.
    """

    def __init__(self) -> None:
        """Create the node and its endpoints."""
        super().__init__('sensor_publisher')
        self.sensor_data_publisher = self.create_publisher(
            String,
            'sensor_data',
            10,
        )
        self.sensor_data_timer = self.create_timer(
            0.5,
            self.publish_sensor_data,
        )

    def publish_sensor_data(self) -> None:
        """Publish a message on sensor_data."""
        message = String(
            data='Temperature: 25.5C',
        )
        self.sensor_data_publisher.publish(message)


def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init(args=args)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        try:
            executor = SingleThreadedExecutor()
            node = SensorPublisher()
            executor.add_node(node)
            while ok():
                # not without end: rclpy can miss a signal that comes while it starts
                executor.spin_once(timeout_sec=1.0)
        except Exception:
            if ok():  # otherwise a signal shut rclpy down before the node was complete
                raise


if __name__ == '__main__':
    main()
