"""The node countdown_action_client sends goals to countdown."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

import argparse
from collections.abc import Callable
import sys
import time
from typing import Any

from action_msgs.msg import GoalStatus
from my_robot_controller.action import Countdown
from my_robot_controller.node_main import interruptible
from rclpy.action.client import ActionClient, ClientGoalHandle
from rclpy.node import Node
from rclpy.task import Future
from rclpy.utilities import remove_ros_args


class CountdownActionClient(Node):
    """The node countdown_action_client sends goals to countdown."""

    def __init__(self, timeout: float) -> None:
        """Create the node and its endpoints."""
        super().__init__('countdown_action_client')
        self.timeout = timeout
        self.countdown_sent: Future | None = None
        self.countdown_client = ActionClient(self, Countdown, 'countdown')

    async def send_countdown(self, goal: Countdown.Goal) -> bool:
        """Send a goal to countdown; return whether it was reached."""
        if not await self.until(self.countdown_client.server_is_ready):
            self.get_logger().error('countdown: gave up waiting for a server')
            return False
        sent = self.countdown_client.send_goal_async(goal, feedback_callback=self.follow_countdown)
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
        self.get_logger().info(
            f'countdown: final_count={result.final_count!r} success={result.success!r}'
        )
        return bool(ending.result().status == GoalStatus.STATUS_SUCCEEDED)

    def follow_countdown(self, message: Any) -> None:
        """Log the feedback that the server sends about the goal."""
        feedback: Countdown.Feedback = message.feedback
        self.get_logger().info(f'countdown: current_count={feedback.current_count!r}')

    async def cancel_countdown(self) -> None:
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
        description='The node countdown_action_client sends goals to countdown.',
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


def countdown_request(given: argparse.Namespace) -> Countdown.Goal:
    """Return the goal that the command line describes."""
    return Countdown.Goal(
        target_count=given.target_count,
    )


def main(args: list[str] | None = None) -> int:
    """Do what the command line asks for; return 0 if it succeeded."""
    given = parse_arguments(args)
    with interruptible(args) as once:
        node = CountdownActionClient(given.server_timeout)
        once.run(node, node.send_countdown, countdown_request(given), node.cancel_countdown)
    return once.status


if __name__ == '__main__':
    sys.exit(main())
