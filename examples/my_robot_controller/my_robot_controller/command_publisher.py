"""The node command_publisher publishes robot_command."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from my_robot_controller.msg import RobotCommand
from my_robot_controller.node_main import until_shutdown, WakingExecutor
import rclpy
from rclpy.node import Node


class CommandPublisher(Node):
    """The node command_publisher publishes robot_command."""

    def __init__(self) -> None:
        """Create the node and its endpoints."""
        super().__init__('command_publisher')
        self.speed = 0.0
        self.robot_command_publisher = self.create_publisher(RobotCommand, 'robot_command', 10)
        self.robot_command_timer = self.create_timer(1.0, self.publish_robot_command)

    def publish_robot_command(self) -> None:
        """Publish a message on robot_command."""
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


@until_shutdown
def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init(args=args)
    node = CommandPublisher()
    executor = WakingExecutor()
    rclpy.spin(node, executor)


if __name__ == '__main__':
    main()
