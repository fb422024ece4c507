"""Listens to chatter."""

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
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
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == '__main__':
    main()
