"""Listens to sensor_data."""

import rclpy
from rclpy.node import Node
from rclpy.utilities import ok
from std_msgs.msg import String


class SensorSubscriber(Node):
    def __init__(self) -> None:
        super().__init__('sensor_subscriber')
        self.sensor_data_subscription = self.create_subscription(
            String, 'sensor_data', self.receive_sensor_data, 10
        )

    def receive_sensor_data(self, message: String) -> None:
        self.get_logger().info(f'sensor_data: {message.data=}')


def main(args: list[str] | None = None) -> None:
    rclpy.init(args=args)
    try:
        rclpy.spin(SensorSubscriber())
    except BaseException as error:
        if ok() and not isinstance(error, KeyboardInterrupt):  # otherwise a signal ended it
            raise


if __name__ == '__main__':
    main()
