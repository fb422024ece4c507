"""The node sensor_subscriber listens to sensor_data."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from my_robot_controller.node_main import until_shutdown, WakingExecutor
import rclpy
from rclpy.node import Node
from std_msgs.msg import String


class SensorSubscriber(Node):
    """The node sensor_subscriber listens to sensor_data."""

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
        self.get_logger().info(f'sensor_data: data={message.data!r}')


@until_shutdown
def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init(args=args)
    node = SensorSubscriber()
    executor = WakingExecutor()
    rclpy.spin(node, executor)


if __name__ == '__main__':
    main()
