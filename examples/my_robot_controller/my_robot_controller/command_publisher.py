"""The node command_publisher publishes robot_command."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from my_robot_controller.msg import RobotCommand
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import ok, try_shutdown


class CommandPublisher(Node):
    """The node command_publisher publishes robot_command."""

    def __init__(self) -> None:
        """Create what the node consists of."""
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


def main(args: list[str] | None = None) -> None:
    """Run the node until it is asked to end."""
    try:
        rclpy.init(args=args)
        executor = SingleThreadedExecutor()
        node = CommandPublisher()
        executor.add_node(node)
        # a signal that comes while rclpy starts can fail to wake it, so it waits a second at most
        while ok():
            executor.spin_once(timeout_sec=1.0)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except Exception:
        if ok():
            raise
        # otherwise it was asked to end before it was complete
    finally:
        try:
            try_shutdown()
        except RuntimeError:
            pass  # the signal that ended the node is shutting rclpy down at this very moment


if __name__ == '__main__':
    main()
