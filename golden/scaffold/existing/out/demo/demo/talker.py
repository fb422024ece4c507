"""The node talker publishes chatter."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import ok, try_shutdown
from std_msgs.msg import String


class Talker(Node):
    """The node talker publishes chatter."""

    def __init__(self) -> None:
        """Create what the node consists of."""
        super().__init__('talker')
        self.chatter_publisher = self.create_publisher(String, 'chatter', 10)
        self.chatter_timer = self.create_timer(1.0, self.publish_chatter)

    def publish_chatter(self) -> None:
        """Publish a message on chatter."""
        message = String(
            data='hello',
        )
        self.chatter_publisher.publish(message)


def main(args: list[str] | None = None) -> None:
    """Run the node until it is asked to end."""
    try:
        rclpy.init(args=args)
        executor = SingleThreadedExecutor()
        node = Talker()
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
