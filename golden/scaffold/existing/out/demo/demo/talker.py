"""The node talker publishes chatter."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from demo.node_main import until_shutdown, WakingExecutor
import rclpy
from rclpy.node import Node
from std_msgs.msg import String


class Talker(Node):
    """The node talker publishes chatter."""

    def __init__(self) -> None:
        """Create the node and its endpoints."""
        super().__init__('talker')
        self.chatter_publisher = self.create_publisher(String, 'chatter', 10)
        self.chatter_timer = self.create_timer(1.0, self.publish_chatter)

    def publish_chatter(self) -> None:
        """Publish a message on chatter."""
        message = String(
            data='hello',
        )
        self.chatter_publisher.publish(message)


@until_shutdown
def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init(args=args)
    node = Talker()
    executor = WakingExecutor()
    rclpy.spin(node, executor)


if __name__ == '__main__':
    main()
