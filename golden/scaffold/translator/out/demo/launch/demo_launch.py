"""Start the nodes of demo."""

from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """Return the nodes to start."""
    return LaunchDescription(
        [
            # the nodes
            Node(package='demo', executable='translator', output='screen'),
        ]
    )
