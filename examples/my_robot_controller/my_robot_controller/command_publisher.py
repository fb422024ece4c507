"""The node command_publisher."""

from __future__ import annotations

from contextlib import suppress

from my_robot_controller.msg import RobotCommand
import rclpy
from rclpy.executors import (
    ExternalShutdownException,
    SingleThreadedExecutor,
)
from rclpy.node import Node
from rclpy.utilities import ok


class CommandPublisher(Node):
    """
    The node command_publisher.

    It publishes robot_command.
    """

    def __init__(self) -> None:
        """Create the node and its endpoints."""
        super().__init__('command_publisher')
        self.speed = 0.0
        self.robot_command_publisher = self.create_publisher(
            RobotCommand,
            'robot_command',
            10,
        )
        self.robot_command_timer = self.create_timer(
            1.0,
            self.publish_robot_command,
        )

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


def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init(args=args)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        try:
            executor = SingleThreadedExecutor()
            node = CommandPublisher()
            executor.add_node(node)
            while ok():
                # not without end: rclpy can miss a signal that comes while it starts
                executor.spin_once(timeout_sec=1.0)
        except Exception:
            if ok():  # otherwise a signal shut rclpy down before the node was complete
                raise


if __name__ == '__main__':
    main()
