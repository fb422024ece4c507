"""The node talker."""

from __future__ import annotations

from contextlib import suppress

from demo.msg import Command
from geometry_msgs.msg import (
    Twist,
    Vector3,
)
import rclpy
from rclpy.executors import (
    ExternalShutdownException,
    SingleThreadedExecutor,
)
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    qos_profile_sensor_data,
    QoSProfile,
)
from rclpy.utilities import ok
from std_msgs.msg import String

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Talker(Node):
    """
    The node talker.

    It publishes command.
    It listens to ~/words.
    """

    def __init__(self) -> None:
        """Create the node and its endpoints."""
        super().__init__('talker')
        self.declare_parameter('speed', 0.5)
        self.declare_parameter('names', ['a', 'b'])
        self.command_publisher = self.create_publisher(
            Command,
            'command',
            LATCHED,
        )
        self.command_timer = self.create_timer(
            0.1,
            self.publish_command,
        )
        self.words_subscription = self.create_subscription(
            String,
            '~/words',
            self.receive_words,
            qos_profile_sensor_data,
        )
        self.tick_timer = self.create_timer(
            0.25,
            self.tick,
        )

    @property
    def param_speed(self) -> float:
        """Return the current value of the parameter 'speed'."""
        value: float = self.get_parameter('speed').value
        return value

    @property
    def param_names(self) -> list[str]:
        """Return the current value of the parameter 'names'."""
        value: list[str] = list(self.get_parameter('names').value)
        return value

    def publish_command(self) -> None:
        """Publish a message on command."""
        message = Command(
            command=Command.STOP,
            # where to [m/s]
            twist=Twist(
                linear=Vector3(
                    x=0.0,
                    y=0.0,
                    z=0.0,
                ),
                angular=Vector3(
                    x=0.0,
                    y=0.0,
                    z=0.0,
                ),
            ),
            colour=[0] * 3,
        )
        self.command_publisher.publish(message)

    def receive_words(self, message: String) -> None:
        """Handle a message from ~/words."""
        self.get_logger().info(f'~/words: {message.data=}')

    def tick(self) -> None:
        """Run once per timer period."""
        self.get_logger().info('tick')


def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init(args=args)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        try:
            executor = SingleThreadedExecutor()
            node = Talker()
            executor.add_node(node)
            while ok():
                # not without end: rclpy can miss a signal that comes while it starts
                executor.spin_once(timeout_sec=1.0)
        except Exception:
            if ok():  # otherwise a signal shut rclpy down before the node was complete
                raise


if __name__ == '__main__':
    main()
