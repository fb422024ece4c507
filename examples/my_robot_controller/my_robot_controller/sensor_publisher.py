"""Publishes to sensor_data."""

import rclpy
from rclpy.node import Node
from rclpy.utilities import ok
from std_msgs.msg import String


class SensorPublisher(Node):
    def __init__(self) -> None:
        super().__init__('sensor_publisher')
        self.sensor_data_publisher = self.create_publisher(String, 'sensor_data', 10)
        self.sensor_data_timer = self.create_timer(0.5, self.publish_sensor_data)

    def publish_sensor_data(self) -> None:
        message = String(data='Temperature: 25.5C')
        self.sensor_data_publisher.publish(message)


def main(args: list[str] | None = None) -> None:
    rclpy.init(args=args)
    try:
        rclpy.spin(SensorPublisher())
    except BaseException as error:
        if ok() and not isinstance(error, KeyboardInterrupt):  # otherwise a signal ended it
            raise


if __name__ == '__main__':
    main()
