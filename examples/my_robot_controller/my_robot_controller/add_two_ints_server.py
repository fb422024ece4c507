"""The node add_two_ints_server serves add_two_ints."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from my_robot_controller.srv import AddTwoInts
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import ok, try_shutdown


class AddTwoIntsServer(Node):
    """The node add_two_ints_server serves add_two_ints."""

    def __init__(self) -> None:
        """Create what the node consists of."""
        super().__init__('add_two_ints_server')
        self.add_two_ints_service = self.create_service(
            AddTwoInts,
            'add_two_ints',
            self.handle_add_two_ints,
        )

    def handle_add_two_ints(
        self, request: AddTwoInts.Request, response: AddTwoInts.Response
    ) -> AddTwoInts.Response:
        """Answer a request to add_two_ints."""
        self.get_logger().info(f'add_two_ints: a={request.a!r} b={request.b!r}')
        # a + b
        response.sum = request.a + request.b
        return response


def main(args: list[str] | None = None) -> None:
    """Run the node until it is asked to end."""
    try:
        rclpy.init(args=args)
        executor = SingleThreadedExecutor()
        node = AddTwoIntsServer()
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
