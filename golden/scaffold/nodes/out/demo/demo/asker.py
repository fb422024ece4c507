"""The node asker calls ask."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

import argparse
from collections.abc import Callable
import sys
import time

from demo.node_main import interruptible
from demo.srv import Ask
from rclpy.node import Node
from rclpy.task import Future
from rclpy.utilities import remove_ros_args


class Asker(Node):
    """The node asker calls ask."""

    def __init__(self, timeout: float) -> None:
        """Create the node and its endpoints."""
        super().__init__('asker')
        self.timeout = timeout
        self.ask_client = self.create_client(Ask, 'ask')

    async def call_ask(self, request: Ask.Request) -> bool:
        """Call ask once; return whether it answered in time."""
        if not await self.until(self.ask_client.service_is_ready):
            self.get_logger().error('ask: gave up waiting for a server')
            return False
        answer = self.ask_client.call_async(request)
        if not await self.until(answer.done):
            self.get_logger().error('ask: gave up waiting for an answer')
            return False
        response: Ask.Response | None = answer.result()
        if response is None:
            return False
        self.get_logger().info(f'ask: answer={response.answer!r}')
        return True

    async def until(self, condition: Callable[[], bool]) -> bool:
        """Wait until a condition holds; return whether it did so in time."""
        deadline = time.monotonic() + self.timeout
        while not condition():
            if time.monotonic() > deadline:
                return False
            await self.pause(0.05)
        return True

    async def pause(self, seconds: float) -> None:
        """Wait without blocking: other callbacks run in the meantime."""
        over: Future = Future()
        timer = self.create_timer(seconds, lambda: over.set_result(None))
        await over
        self.destroy_timer(timer)


def parse_arguments(args: list[str] | None) -> argparse.Namespace:
    """Parse the command line, without ROS 2's own arguments."""
    parser = argparse.ArgumentParser(
        description='The node asker calls ask.',
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    parser.add_argument(
        '--server-timeout',
        type=float,
        default=5.0,
        metavar='SECONDS',
        help='How long to wait for a server and for its answer.',
    )
    parser.add_argument('question', type=str, nargs='?', default='', help='question')
    parser.add_argument(
        '--loud',
        action=argparse.BooleanOptionalAction,
        default=False,
        help='loud',
    )
    parser.add_argument('--weights', type=float, nargs='*', default=[], help='weights')
    words = remove_ros_args(sys.argv if args is None else args)
    return parser.parse_args(words[1:])


def ask_request(given: argparse.Namespace) -> Ask.Request:
    """Return the request that the command line describes."""
    return Ask.Request(
        question=given.question,
        loud=given.loud,
        weights=given.weights,
    )


def main(args: list[str] | None = None) -> int:
    """Do what the command line asks for; return 0 if it succeeded."""
    given = parse_arguments(args)
    with interruptible(args) as once:
        node = Asker(given.server_timeout)
        once.run(node, node.call_ask, ask_request(given))
    return once.status


if __name__ == '__main__':
    sys.exit(main())
