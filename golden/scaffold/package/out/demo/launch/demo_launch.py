"""Start the nodes of demo."""

from launch import LaunchDescription


def generate_launch_description() -> LaunchDescription:
    """Return the nodes to start."""
    return LaunchDescription(
        [
            # the nodes
        ]
    )
