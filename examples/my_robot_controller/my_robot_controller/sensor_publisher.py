"""The node sensor_publisher publishes sensor_data."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from my_robot_controller.node_main import until_shutdown, WakingExecutor
import rclpy
from rclpy.node import Node
from std_msgs.msg import String


class SensorPublisher(Node):
    """The node sensor_publisher publishes sensor_data."""

    def __init__(self) -> None:
        """Create the node and its endpoints."""
        super().__init__('sensor_publisher')
        self.sensor_data_publisher = self.create_publisher(String, 'sensor_data', 10)
        self.sensor_data_timer = self.create_timer(0.5, self.publish_sensor_data)

    def publish_sensor_data(self) -> None:
        """Publish a message on sensor_data."""
        message = String(
            data='Temperature: 25.5C',
        )
        self.sensor_data_publisher.publish(message)


@until_shutdown
def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init(args=args)
    node = SensorPublisher()
    executor = WakingExecutor()
    rclpy.spin(node, executor)


if __name__ == '__main__':
    main()
