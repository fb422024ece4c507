"""Publishes to chatter."""

import rclpy
from rclpy.node import Node
from rclpy.utilities import ok
from std_msgs.msg import String


class Talker(Node):
    def __init__(self) -> None:
        super().__init__('talker')
        self.chatter_publisher = self.create_publisher(String, 'chatter', 10)
        self.chatter_timer = self.create_timer(1.0, self.publish_chatter)

    def publish_chatter(self) -> None:
        message = String(data='hello')
        self.chatter_publisher.publish(message)


def main(args: list[str] | None = None) -> None:
    rclpy.init(args=args)
    try:
        rclpy.spin(Talker())
    except BaseException as error:
        if ok() and not isinstance(error, KeyboardInterrupt):  # otherwise a signal ended it
            raise


if __name__ == '__main__':
    main()
