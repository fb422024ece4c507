"""Calls add_two_ints."""

import sys

from my_robot_controller.srv import AddTwoInts
import rclpy
from rclpy.node import Node
from rclpy.utilities import ok


class AddTwoIntsClient(Node):
    def __init__(self) -> None:
        super().__init__('add_two_ints_client')
        self.add_two_ints_client = self.create_client(AddTwoInts, 'add_two_ints')

    def call_add_two_ints(self, request: AddTwoInts.Request) -> None:
        while self.context.ok() and not self.add_two_ints_client.service_is_ready():
            self.get_logger().info('add_two_ints: waiting for a server')
            rclpy.spin_once(self, timeout_sec=1.0)
        answer = self.add_two_ints_client.call_async(request)
        rclpy.spin_until_future_complete(self, answer)
        response: AddTwoInts.Response | None = answer.result()
        if response is not None:
            self.get_logger().info(f'Result: {response.sum} = {request.a} + {request.b}')


def main(args: list[str] | None = None) -> None:
    rclpy.init(args=args)
    try:
        a, b = map(int, sys.argv[1:3] or ['2', '3'])
        node = AddTwoIntsClient()
        node.call_add_two_ints(AddTwoInts.Request(a=a, b=b))
    except BaseException as error:
        if ok() and not isinstance(error, KeyboardInterrupt):  # otherwise a signal ended it
            raise


if __name__ == '__main__':
    main()
