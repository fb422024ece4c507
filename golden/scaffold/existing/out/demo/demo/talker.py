"""The node talker."""

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


class Talker(Node):
    """
    The node talker.

    It publishes chatter.
    """

    def __init__(self) -> None:
        """Create the node and its endpoints."""
        super().__init__('talker')
        self.chatter_publisher = self.create_publisher(
            String,
            'chatter',
            10,
        )
        self.chatter_timer = self.create_timer(
            1.0,
            self.publish_chatter,
        )

    def publish_chatter(self) -> None:
        """Publish a message on chatter."""
        message = String(
            data='hello',
        )
        self.chatter_publisher.publish(message)


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
