"""The node oracle serves ask."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

import signal

from demo.srv import Ask
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import install_signal_handlers, SignalHandlerOptions
from rclpy.utilities import try_shutdown


class Oracle(Node):
    """The node oracle serves ask."""

    def __init__(self) -> None:
        """Create what the node consists of."""
        super().__init__('oracle')
        self.ask_service = self.create_service(Ask, 'ask', self.handle_ask)

    def handle_ask(self, request: Ask.Request, response: Ask.Response) -> Ask.Response:
        """Answer a request to ask."""
        self.get_logger().info(f'ask: question={request.question!r} loud={request.loud!r}')
        # the truth
        response.answer = ''
        response.stamp = self.get_clock().now().to_msg()
        return response


def main(args: list[str] | None = None) -> None:
    """Run the node until it is asked to end."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        node = Oracle()
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
