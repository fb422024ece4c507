"""The node add_two_ints_client."""

from __future__ import annotations

import argparse
from collections.abc import Callable
import signal
import sys
from threading import Event
import time

from my_robot_controller.srv import AddTwoInts
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


class AddTwoIntsClient(Node):
    """
    The node add_two_ints_client.

    It calls add_two_ints.
    """

    def __init__(self, timeout: float) -> None:
        """Create the node and its endpoints."""
        super().__init__('add_two_ints_client')
        self.timeout = timeout
        self.add_two_ints_client = self.create_client(
            AddTwoInts,
            'add_two_ints',
        )

    async def call_add_two_ints(self, request: AddTwoInts.Request) -> bool:
        """Call add_two_ints once; return whether it answered in time."""
        if not await self.until(self.add_two_ints_client.service_is_ready):
            self.get_logger().error('add_two_ints: gave up waiting for a server')
            return False
        answer = self.add_two_ints_client.call_async(request)
        if not await self.until(answer.done):
            self.get_logger().error('add_two_ints: gave up waiting for an answer')
            return False
        response: AddTwoInts.Response | None = answer.result()
        if response is None:
            return False
        self.get_logger().info(f'Result: {response.sum} = {request.a} + {request.b}')
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
        description=AddTwoIntsClient.__doc__,
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
        'a',
        type=int,
        nargs='?',
        default=2,
        help='a',
    )
    parser.add_argument(
        'b',
        type=int,
        nargs='?',
        default=3,
        help='b',
    )
    words = remove_ros_args(sys.argv if args is None else args)
    return parser.parse_args(words[1:])


def add_two_ints_request(options: argparse.Namespace) -> AddTwoInts.Request:
    """Return the request that the command line describes."""
    return AddTwoInts.Request(
        a=options.a,
        b=options.b,
    )


def main(args: list[str] | None = None) -> int:
    """Do what the command line asks for; return 0 if it succeeded."""
    options = parse_arguments(args)
    interrupted = Event()
    # not by rclpy, which would shut down before goals are cancelled
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: interrupted.set())
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    node = AddTwoIntsClient(options.server_timeout)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    tasks = [
        executor.create_task(
            node.call_add_two_ints,
            add_two_ints_request(options),
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
