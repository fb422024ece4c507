"""The node sensor_subscriber listens to sensor_data."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

import signal

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import install_signal_handlers, SignalHandlerOptions
from rclpy.utilities import try_shutdown
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
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        node = SensorSubscriber()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        install_signal_handlers()  # not before: they would shut down what is being created
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        try_shutdown()


if __name__ == '__main__':
    main()
