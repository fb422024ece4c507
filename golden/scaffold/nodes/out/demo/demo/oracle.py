"""The node oracle serves ask."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from demo.srv import Ask
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import ok, try_shutdown


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
    try:
        rclpy.init(args=args)
        executor = SingleThreadedExecutor()
        node = Oracle()
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
