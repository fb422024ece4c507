"""The node listener listens to chatter."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from demo.node_main import until_shutdown, WakingExecutor
import rclpy
from rclpy.node import Node
from std_msgs.msg import String


class Listener(Node):
    """The node listener listens to chatter."""

    def __init__(self) -> None:
        """Create the node and its endpoints."""
        super().__init__('listener')
        self.chatter_subscription = self.create_subscription(
            String,
            'chatter',
            self.receive_chatter,
            10,
        )

    def receive_chatter(self, message: String) -> None:
        """Handle a message from chatter."""
        self.get_logger().info(f'chatter: data={message.data!r}')


@until_shutdown
def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init(args=args)
    node = Listener()
    executor = WakingExecutor()
    rclpy.spin(node, executor)


if __name__ == '__main__':
    main()
