"""Start the nodes of my_robot_controller."""

from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """Return the nodes to start."""
    return LaunchDescription(
        [
            # the nodes
            Node(package='my_robot_controller', executable='sensor_publisher', output='screen'),
            Node(package='my_robot_controller', executable='sensor_subscriber', output='screen'),
            Node(package='my_robot_controller', executable='command_publisher', output='screen'),
            Node(package='my_robot_controller', executable='add_two_ints_server', output='screen'),
            Node(
                package='my_robot_controller',
                executable='countdown_action_server',
                output='screen',
            ),
            Node(package='my_robot_controller', executable='execute_task_server', output='screen'),
        ]
    )
