"""Serves ask."""

from demo.srv import Ask
import rclpy
from rclpy.node import Node
from rclpy.utilities import ok


class Oracle(Node):
    def __init__(self) -> None:
        super().__init__('oracle')
        self.ask_service = self.create_service(Ask, 'ask', self.handle_ask)

    def handle_ask(self, request: Ask.Request, response: Ask.Response) -> Ask.Response:
        self.get_logger().info(f'ask: {request.question=}')
        # the truth
        response.answer = ''
        response.stamp = self.get_clock().now().to_msg()
        return response


def main(args: list[str] | None = None) -> None:
    rclpy.init(args=args)
    try:
        rclpy.spin(Oracle())
    except BaseException as error:
        if ok() and not isinstance(error, KeyboardInterrupt):  # otherwise a signal ended it
            raise


if __name__ == '__main__':
    main()
