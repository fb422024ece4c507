"""Calls ask."""

from demo.srv import Ask
import rclpy
from rclpy.node import Node
from rclpy.utilities import ok


class Caller(Node):
    def __init__(self) -> None:
        super().__init__('caller')
        self.ask_client = self.create_client(Ask, 'ask')

    def call_ask(self, request: Ask.Request) -> None:
        while self.context.ok() and not self.ask_client.service_is_ready():
            self.get_logger().info('ask: waiting for a server')
            rclpy.spin_once(self, timeout_sec=1.0)
        answer = self.ask_client.call_async(request)
        rclpy.spin_until_future_complete(self, answer)
        response: Ask.Response | None = answer.result()
        if response is not None:
            self.get_logger().info(f'ask: {response.answer=}')


def main(args: list[str] | None = None) -> None:
    rclpy.init(args=args)
    try:
        node = Caller()
        node.call_ask(Ask.Request(question='', loud=False, weights=[]))
    except BaseException as error:
        if ok() and not isinstance(error, KeyboardInterrupt):  # otherwise a signal ended it
            raise


if __name__ == '__main__':
    main()
