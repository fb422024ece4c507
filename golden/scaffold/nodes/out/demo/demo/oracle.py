"""Serves ask."""

from demo.srv import Ask
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node


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
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == '__main__':
    main()
