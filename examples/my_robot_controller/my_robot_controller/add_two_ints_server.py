"""The node add_two_ints_server."""

from __future__ import annotations

from contextlib import suppress

from my_robot_controller.srv import AddTwoInts
import rclpy
from rclpy.executors import (
    ExternalShutdownException,
    SingleThreadedExecutor,
)
from rclpy.node import Node
from rclpy.utilities import ok


class AddTwoIntsServer(Node):
    """
    The node add_two_ints_server.

    It serves add_two_ints.
    """

    def __init__(self) -> None:
        """Create the node and its endpoints."""
        super().__init__('add_two_ints_server')
        self.add_two_ints_service = self.create_service(
            AddTwoInts,
            'add_two_ints',
            self.handle_add_two_ints,
        )

    def handle_add_two_ints(
        self,
        request: AddTwoInts.Request,
        response: AddTwoInts.Response,
    ) -> AddTwoInts.Response:
        """Answer a request to add_two_ints."""
        self.get_logger().info(f'add_two_ints: {request=}')
        # a + b
        response.sum = request.a + request.b
        return response


def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init(args=args)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        try:
            executor = SingleThreadedExecutor()
            node = AddTwoIntsServer()
            executor.add_node(node)
            while ok():
                # not without end: rclpy can miss a signal that comes while it starts
                executor.spin_once(timeout_sec=1.0)
        except Exception:
            if ok():  # otherwise a signal shut rclpy down before the node was complete
                raise


if __name__ == '__main__':
    main()
