"""The node sensor_subscriber."""

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


class SensorSubscriber(Node):
    """
    The node sensor_subscriber.

    It listens to sensor_data.
    """

    def __init__(self) -> None:
        """Create the node and its endpoints."""
        super().__init__('sensor_subscriber')
        self.sensor_data_subscription = self.create_subscription(
            String,
            'sensor_data',
            self.receive_sensor_data,
            10,
        )

    def receive_sensor_data(self, message: String) -> None:
        """Handle a message from sensor_data."""
        self.get_logger().info(f'sensor_data: {message.data=}')


def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init(args=args)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        try:
            executor = SingleThreadedExecutor()
            node = SensorSubscriber()
            executor.add_node(node)
            while ok():
                # not without end: rclpy can miss a signal that comes while it starts
                executor.spin_once(timeout_sec=1.0)
        except Exception:
            if ok():  # otherwise a signal shut rclpy down before the node was complete
                raise


if __name__ == '__main__':
    main()
