"""The node both."""

from __future__ import annotations

import argparse
from collections.abc import Callable
import signal
import sys
from threading import Event
import time
from typing import Any

from action_msgs.msg import GoalStatus
from demo.action import Dock
from demo.srv import Ask
import rclpy
from rclpy.action.client import (
    ActionClient,
    ClientGoalHandle,
)
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from rclpy.utilities import (
    ok,
    remove_ros_args,
    try_shutdown,
)


class Both(Node):
    """
    The node both.

    Calls ask.
    Sends dock goals.
    """

    def __init__(self, timeout: float) -> None:
        """Create the node and its endpoints."""
        super().__init__('both')
        self.timeout = timeout
        self.dock_sent: Future | None = None
        self.ask_client = self.create_client(
            Ask,
            'ask',
        )
        self.dock_client = ActionClient(
            self,
            Dock,
            'dock',
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

    async def send_dock_goal(self, goal: Dock.Goal) -> bool:
        """Send a goal to dock; return whether it was reached."""
        if not await self.until(self.dock_client.server_is_ready):
            self.get_logger().error('dock: gave up waiting for a server')
            return False
        sent = self.dock_client.send_goal_async(
            goal,
            feedback_callback=self.follow_dock_goal,
        )
        self.dock_sent = sent
        if not await self.until(sent.done):
            self.get_logger().error('dock: gave up waiting for an answer')
            return False
        goal_handle: ClientGoalHandle = sent.result()
        if not goal_handle.accepted:
            self.get_logger().error('dock: the goal was rejected')
            return False
        ending = goal_handle.get_result_async()
        while not ending.done():
            if not self.dock_client.server_is_ready():
                self.get_logger().error('dock: the server has gone')
                return False
            await self.pause(0.05)
        self.dock_sent = None
        result: Dock.Result = ending.result().result
        self.get_logger().info(f'dock: {result.docked=}')
        return bool(ending.result().status == GoalStatus.STATUS_SUCCEEDED)

    def follow_dock_goal(self, message: Any) -> None:
        """Log the feedback that the server sends about the goal."""
        feedback: Dock.Feedback = message.feedback
        self.get_logger().info(f'dock: {feedback.distance=}')

    async def cancel_dock_goal(self) -> None:
        """Ask the server to cancel the goal."""
        sent = self.dock_sent
        if sent is not None and await self.until(sent.done):
            answer = sent.result().cancel_goal_async()
            if await self.until(answer.done):
                self.get_logger().info('dock: cancelled')

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
        description=Both.__doc__,
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
        '--ask-question',
        type=str,
        default='',
        help='question',
    )
    parser.add_argument(
        '--ask-loud',
        action=argparse.BooleanOptionalAction,
        default=False,
        help='loud',
    )
    parser.add_argument(
        '--ask-weights',
        type=float,
        nargs='*',
        default=[],
        help='weights',
    )
    parser.add_argument(
        '--dock-station',
        type=int,
        default=1,
        help='station',
    )
    words = remove_ros_args(sys.argv if args is None else args)
    return parser.parse_args(words[1:])


def ask_request(options: argparse.Namespace) -> Ask.Request:
    """Return the request that the command line describes."""
    return Ask.Request(
        question=options.ask_question,
        loud=options.ask_loud,
        weights=options.ask_weights,
    )


def dock_request(options: argparse.Namespace) -> Dock.Goal:
    """Return the goal that the command line describes."""
    return Dock.Goal(
        station=options.dock_station,
    )


def main(args: list[str] | None = None) -> int:
    """Send the request and the goal; return 0 if it succeeded."""
    options = parse_arguments(args)
    interrupted = Event()
    # not by rclpy, which would shut down before goals are cancelled
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: interrupted.set())
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    node = Both(options.server_timeout)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    tasks = [
        executor.create_task(
            node.call_ask,
            ask_request(options),
        ),
        executor.create_task(
            node.send_dock_goal,
            dock_request(options),
        ),
    ]
    while ok() and not interrupted.is_set() and not all(task.done() for task in tasks):
        executor.spin_once(timeout_sec=0.1)
    if interrupted.is_set():
        task = executor.create_task(node.cancel_dock_goal)
        executor.spin_until_future_complete(task)
    try_shutdown()
    if interrupted.is_set():
        return 130
    return 0 if all(task.result() for task in tasks) else 1


if __name__ == '__main__':
    sys.exit(main())
