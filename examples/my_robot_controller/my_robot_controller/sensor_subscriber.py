"""The node sensor_subscriber listens to sensor_data."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import ok, try_shutdown
from std_msgs.msg import String


class SensorSubscriber(Node):
    """The node sensor_subscriber listens to sensor_data."""

    def __init__(self) -> None:
        """Create what the node consists of."""
        super().__init__('sensor_subscriber')
        self.sensor_data_subscription = self.create_subscription(
            String,
            'sensor_data',
            self.receive_sensor_data,
            10,
        )

    def receive_sensor_data(self, message: String) -> None:
        """Act on a message from sensor_data."""
        self.get_logger().info(f'sensor_data: data={message.data!r}')


def main(args: list[str] | None = None) -> None:
    """Run the node until it is asked to end."""
    try:
        rclpy.init(args=args)
        executor = SingleThreadedExecutor()
        node = SensorSubscriber()
        executor.add_node(node)
        # a signal that comes while rclpy starts can fail to wake it, so it waits a second at most
        while ok():
            executor.spin_once(timeout_sec=1.0)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except Exception:
        if ok():
            raise
        # otherwise it was asked to end before it was complete
    finally:
        try:
            try_shutdown()
        except RuntimeError:
            pass  # the signal that ended the node is shutting rclpy down at this very moment


if __name__ == '__main__':
    main()
