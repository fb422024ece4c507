"""The node countdown_action_client."""

from __future__ import annotations

import argparse
from collections.abc import Callable
import signal
import sys
from threading import Event
import time
from typing import Any

from action_msgs.msg import GoalStatus
from my_robot_controller.action import Countdown
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


class CountdownActionClient(Node):
    """
    The node countdown_action_client.

    It sends goals to countdown.
    """

    def __init__(self, timeout: float) -> None:
        """Create the node and its endpoints."""
        super().__init__('countdown_action_client')
        self.timeout = timeout
        self.countdown_sent: Future | None = None
        self.countdown_client = ActionClient(
            self,
            Countdown,
            'countdown',
        )

    async def send_countdown_goal(self, goal: Countdown.Goal) -> bool:
        """Send a goal to countdown; return whether it was reached."""
        if not await self.until(self.countdown_client.server_is_ready):
            self.get_logger().error('countdown: gave up waiting for a server')
            return False
        sent = self.countdown_client.send_goal_async(
            goal,
            feedback_callback=self.follow_countdown_goal,
        )
        self.countdown_sent = sent
        if not await self.until(sent.done):
            self.get_logger().error('countdown: gave up waiting for an answer')
            return False
        goal_handle: ClientGoalHandle = sent.result()
        if not goal_handle.accepted:
            self.get_logger().error('countdown: the goal was rejected')
            return False
        ending = goal_handle.get_result_async()
        while not ending.done():
            if not self.countdown_client.server_is_ready():
                self.get_logger().error('countdown: the server has gone')
                return False
            await self.pause(0.05)
        self.countdown_sent = None
        result: Countdown.Result = ending.result().result
        self.get_logger().info(f'countdown: {result=}')
        return bool(ending.result().status == GoalStatus.STATUS_SUCCEEDED)

    def follow_countdown_goal(self, message: Any) -> None:
        """Log the feedback that the server sends about the goal."""
        feedback: Countdown.Feedback = message.feedback
        self.get_logger().info(f'countdown: {feedback.current_count=}')

    async def cancel_countdown_goal(self) -> None:
        """Ask the server to cancel the goal."""
        sent = self.countdown_sent
        if sent is not None and await self.until(sent.done):
            answer = sent.result().cancel_goal_async()
            if await self.until(answer.done):
                self.get_logger().info('countdown: cancelled')

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
        description=CountdownActionClient.__doc__,
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
        'target_count',
        type=int,
        nargs='?',
        default=5,
        help='Where to start counting down',
    )
    words = remove_ros_args(sys.argv if args is None else args)
    return parser.parse_args(words[1:])


def countdown_request(options: argparse.Namespace) -> Countdown.Goal:
    """Return the goal that the command line describes."""
    return Countdown.Goal(
        target_count=options.target_count,
    )


def main(args: list[str] | None = None) -> int:
    """Do what the command line asks for; return 0 if it succeeded."""
    options = parse_arguments(args)
    interrupted = Event()
    # not by rclpy, which would shut down before goals are cancelled
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: interrupted.set())
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    node = CountdownActionClient(options.server_timeout)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    tasks = [
        executor.create_task(
            node.send_countdown_goal,
            countdown_request(options),
        ),
    ]
    while ok() and not interrupted.is_set() and not all(task.done() for task in tasks):
        executor.spin_once(timeout_sec=0.1)
    if interrupted.is_set():
        executor.spin_until_future_complete(executor.create_task(node.cancel_countdown_goal))
    try_shutdown()
    if interrupted.is_set():
        return 130
    return 0 if all(task.result() for task in tasks) else 1


if __name__ == '__main__':
    sys.exit(main())
