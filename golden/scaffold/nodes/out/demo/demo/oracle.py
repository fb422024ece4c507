"""The node oracle serves ask."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from demo.node_main import until_shutdown, WakingExecutor
from demo.srv import Ask
import rclpy
from rclpy.node import Node


class Oracle(Node):
    """The node oracle serves ask."""

    def __init__(self) -> None:
        """Create the node and its endpoints."""
        super().__init__('oracle')
        self.ask_service = self.create_service(Ask, 'ask', self.handle_ask)

    def handle_ask(self, request: Ask.Request, response: Ask.Response) -> Ask.Response:
        """Answer a request to ask."""
        self.get_logger().info(f'ask: question={request.question!r} loud={request.loud!r}')
        # the truth
        response.answer = ''
        response.stamp = self.get_clock().now().to_msg()
        return response


@until_shutdown
def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init(args=args)
    node = Oracle()
    executor = WakingExecutor()
    rclpy.spin(node, executor)


if __name__ == '__main__':
    main()
