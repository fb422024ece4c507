"""
The node talker.

Publishes to command.
Listens to ~/words.
"""

from demo.msg import Command
from geometry_msgs.msg import Twist, Vector3
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, qos_profile_sensor_data, QoSProfile
from rclpy.utilities import ok
from std_msgs.msg import String

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Talker(Node):
    def __init__(self) -> None:
        super().__init__('talker')
        self.declare_parameter('speed', 0.5)
        self.declare_parameter('names', ['a', 'b'])
        self.command_publisher = self.create_publisher(Command, 'command', LATCHED)
        self.command_timer = self.create_timer(0.1, self.publish_command)
        self.words_subscription = self.create_subscription(
            String, '~/words', self.receive_words, qos_profile_sensor_data
        )
        self.tick_timer = self.create_timer(0.25, self.tick)

    def publish_command(self) -> None:
        message = Command(
            command=Command.STOP,
            # where to [m/s]
            twist=Twist(linear=Vector3(x=0.0, y=0.0, z=0.0), angular=Vector3(x=0.0, y=0.0, z=0.0)),
            colour=[0] * 3,
        )
        self.command_publisher.publish(message)

    def receive_words(self, message: String) -> None:
        self.get_logger().info(f'~/words: {message.data=}')

    def tick(self) -> None:
        self.get_logger().info('tick')


def main(args: list[str] | None = None) -> None:
    rclpy.init(args=args)
    try:
        rclpy.spin(Talker())
    except BaseException as error:
        if ok() and not isinstance(error, KeyboardInterrupt):  # otherwise a signal ended it
            raise


if __name__ == '__main__':
    main()
