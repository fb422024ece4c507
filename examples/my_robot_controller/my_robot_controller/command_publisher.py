"""Publishes to robot_command."""

from my_robot_controller.msg import RobotCommand
import rclpy
from rclpy.node import Node
from rclpy.utilities import ok


class CommandPublisher(Node):
    def __init__(self) -> None:
        super().__init__('command_publisher')
        self.speed = 0.0
        self.robot_command_publisher = self.create_publisher(RobotCommand, 'robot_command', 10)
        self.robot_command_timer = self.create_timer(1.0, self.publish_robot_command)

    def publish_robot_command(self) -> None:
        message = RobotCommand(
            # What to do: STOP, MOVE or TURN
            command_type=RobotCommand.MOVE,
            # Forward speed, negative to reverse [m/s]
            linear_velocity_x=self.speed,
            # Turn rate, counter-clockwise seen from above [rad/s]
            angular_velocity_z=0.0,
            # The frame that the velocities are given in
            frame_id='base_link',
        )
        self.robot_command_publisher.publish(message)
        self.get_logger().info(f'Publishing: linear_velocity_x={self.speed}')
        self.speed = 0.5 - self.speed


def main(args: list[str] | None = None) -> None:
    rclpy.init(args=args)
    try:
        rclpy.spin(CommandPublisher())
    except BaseException as error:
        if ok() and not isinstance(error, KeyboardInterrupt):  # otherwise a signal ended it
            raise


if __name__ == '__main__':
    main()
