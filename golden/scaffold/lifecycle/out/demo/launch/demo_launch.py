"""Start the nodes of demo."""

from launch import LaunchDescription
from launch_ros.actions import LifecycleNode


def generate_launch_description() -> LaunchDescription:
    """Return the nodes to start."""
    return LaunchDescription(
        [
            # the nodes
            LifecycleNode(
                package='demo',
                executable='keeper',
                output='screen',
                name='keeper',
                namespace='',
            ),
        ]
    )
