"""Serves add_two_ints."""

from my_robot_controller.srv import AddTwoInts
import rclpy
from rclpy.node import Node
from rclpy.utilities import ok


class AddTwoIntsServer(Node):
    def __init__(self) -> None:
        super().__init__('add_two_ints_server')
        self.add_two_ints_service = self.create_service(
            AddTwoInts, 'add_two_ints', self.handle_add_two_ints
        )

    def handle_add_two_ints(
        self, request: AddTwoInts.Request, response: AddTwoInts.Response
    ) -> AddTwoInts.Response:
        self.get_logger().info(f'add_two_ints: {request=}')
        # a + b
        response.sum = request.a + request.b
        return response


def main(args: list[str] | None = None) -> None:
    rclpy.init(args=args)
    try:
        rclpy.spin(AddTwoIntsServer())
    except BaseException as error:
        if ok() and not isinstance(error, KeyboardInterrupt):  # otherwise a signal ended it
            raise


if __name__ == '__main__':
    main()
