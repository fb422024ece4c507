"""The node sensor_publisher publishes sensor_data."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import ok, try_shutdown
from std_msgs.msg import String


class SensorPublisher(Node):
    """The node sensor_publisher publishes sensor_data."""

    def __init__(self) -> None:
        """Create what the node consists of."""
        super().__init__('sensor_publisher')
        self.sensor_data_publisher = self.create_publisher(String, 'sensor_data', 10)
        self.sensor_data_timer = self.create_timer(0.5, self.publish_sensor_data)

    def publish_sensor_data(self) -> None:
        """Publish a message on sensor_data."""
        message = String(
            data='Temperature: 25.5C',
        )
        self.sensor_data_publisher.publish(message)


def main(args: list[str] | None = None) -> None:
    """Run the node until it is asked to end."""
    try:
        rclpy.init(args=args)
        executor = SingleThreadedExecutor()
        node = SensorPublisher()
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
