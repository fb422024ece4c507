"""Listens to chatter."""

import rclpy
from rclpy.node import Node
from rclpy.utilities import ok
from std_msgs.msg import String


class Listener(Node):
    def __init__(self) -> None:
        super().__init__('listener')
        self.chatter_subscription = self.create_subscription(
            String, 'chatter', self.receive_chatter, 10
        )

    def receive_chatter(self, message: String) -> None:
        self.get_logger().info(f'chatter: {message.data=}')


def main(args: list[str] | None = None) -> None:
    rclpy.init(args=args)
    try:
        rclpy.spin(Listener())
    except BaseException as error:
        if ok() and not isinstance(error, KeyboardInterrupt):  # otherwise a signal ended it
            raise


if __name__ == '__main__':
    main()
