"""The node oracle."""

from __future__ import annotations

from contextlib import suppress

from demo.srv import Ask
import rclpy
from rclpy.executors import (
    ExternalShutdownException,
    SingleThreadedExecutor,
)
from rclpy.node import Node
from rclpy.utilities import ok


class Oracle(Node):
    """
    The node oracle.

    It serves ask.
    """

    def __init__(self) -> None:
        """Create the node and its endpoints."""
        super().__init__('oracle')
        self.ask_service = self.create_service(
            Ask,
            'ask',
            self.handle_ask,
        )

    def handle_ask(
        self,
        request: Ask.Request,
        response: Ask.Response,
    ) -> Ask.Response:
        """Answer a request to ask."""
        self.get_logger().info(f'ask: {request.question=}')
        # the truth
        response.answer = ''
        response.stamp = self.get_clock().now().to_msg()
        return response


def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init(args=args)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        try:
            executor = SingleThreadedExecutor()
            node = Oracle()
            executor.add_node(node)
            while ok():
                # not without end: rclpy can miss a signal that comes while it starts
                executor.spin_once(timeout_sec=1.0)
        except Exception:
            if ok():  # otherwise a signal shut rclpy down before the node was complete
                raise


if __name__ == '__main__':
    main()
