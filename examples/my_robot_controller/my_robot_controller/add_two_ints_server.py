"""The node add_two_ints_server serves add_two_ints."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from my_robot_controller.node_main import until_shutdown, WakingExecutor
from my_robot_controller.srv import AddTwoInts
import rclpy
from rclpy.node import Node


class AddTwoIntsServer(Node):
    """The node add_two_ints_server serves add_two_ints."""

    def __init__(self) -> None:
        """Create the node and its endpoints."""
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


@until_shutdown
def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init(args=args)
    node = AddTwoIntsServer()
    executor = WakingExecutor()
    rclpy.spin(node, executor)


if __name__ == '__main__':
    main()
