"""The node asker."""

from __future__ import annotations

import argparse
from collections.abc import Callable
import signal
import sys
from threading import Event
import time

from demo.srv import Ask
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from rclpy.utilities import (
    ok,
    remove_ros_args,
    try_shutdown,
)


class Asker(Node):
    """
    The node asker.

    Calls ask.
    """

    def __init__(self, timeout: float) -> None:
        """Create the node and its endpoints."""
        super().__init__('asker')
        self.timeout = timeout
        self.ask_client = self.create_client(
            Ask,
            'ask',
        )

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
        self.get_logger().info(f'ask: {response.answer=}')
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
        description=Asker.__doc__,
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    parser.add_argument(
        '--server-timeout',
        type=float,
        default=5.0,
        metavar='SECONDS',
        help='How long to wait for a server and for its answer.',
    )
    parser.add_argument(
        'question',
        type=str,
        nargs='?',
        default='',
        help='question',
    )
    parser.add_argument(
        '--loud',
        action=argparse.BooleanOptionalAction,
        default=False,
        help='loud',
    )
    parser.add_argument(
        '--weights',
        type=float,
        nargs='*',
        default=[],
        help='weights',
    )
    words = remove_ros_args(sys.argv if args is None else args)
    return parser.parse_args(words[1:])


def ask_request(options: argparse.Namespace) -> Ask.Request:
    """Return the request that the command line describes."""
    return Ask.Request(
        question=options.question,
        loud=options.loud,
        weights=options.weights,
    )


def main(args: list[str] | None = None) -> int:
    """Send the request; return 0 if it succeeded."""
    options = parse_arguments(args)
    interrupted = Event()
    # not by rclpy, which would shut down before goals are cancelled
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: interrupted.set())
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    node = Asker(options.server_timeout)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    tasks = [
        executor.create_task(
            node.call_ask,
            ask_request(options),
        ),
    ]
    while ok() and not interrupted.is_set() and not all(task.done() for task in tasks):
        executor.spin_once(timeout_sec=0.1)
    try_shutdown()
    if interrupted.is_set():
        return 130
    return 0 if all(task.result() for task in tasks) else 1


if __name__ == '__main__':
    sys.exit(main())
