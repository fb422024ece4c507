"""The node both calls ask and sends goals to dock."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

import argparse
from collections.abc import Callable
import sys
import time
from typing import Any

from action_msgs.msg import GoalStatus
from demo.action import Dock
from demo.node_main import interruptible
from demo.srv import Ask
from rclpy.action.client import ActionClient, ClientGoalHandle
from rclpy.node import Node
from rclpy.task import Future
from rclpy.utilities import remove_ros_args


class Both(Node):
    """The node both calls ask and sends goals to dock."""

    def __init__(self, timeout: float) -> None:
        """Create the node and its endpoints."""
        super().__init__('both')
        self.timeout = timeout
        self.dock_sent: Future | None = None
        self.ask_client = self.create_client(Ask, 'ask')
        self.dock_client = ActionClient(self, Dock, 'dock')

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

    async def send_dock(self, goal: Dock.Goal) -> bool:
        """Send a goal to dock; return whether it was reached."""
        if not await self.until(self.dock_client.server_is_ready):
            self.get_logger().error('dock: gave up waiting for a server')
            return False
        sent = self.dock_client.send_goal_async(goal, feedback_callback=self.follow_dock)
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
        self.get_logger().info(f'dock: docked={result.docked!r}')
        return bool(ending.result().status == GoalStatus.STATUS_SUCCEEDED)

    def follow_dock(self, message: Any) -> None:
        """Log the feedback that the server sends about the goal."""
        feedback: Dock.Feedback = message.feedback
        self.get_logger().info(f'dock: distance={feedback.distance!r}')

    async def cancel_dock(self) -> None:
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
        description='The node both calls ask and sends goals to dock.',
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    parser.add_argument(
        '--server-timeout',
        type=float,
        default=5.0,
        metavar='SECONDS',
        help='How long to wait for a server and for its answer.',
    )
    parser.add_argument('--ask-question', type=str, default='', help='question')
    parser.add_argument(
        '--ask-loud',
        action=argparse.BooleanOptionalAction,
        default=False,
        help='loud',
    )
    parser.add_argument('--ask-weights', type=float, nargs='*', default=[], help='weights')
    parser.add_argument('--dock-station', type=int, default=1, help='station')
    words = remove_ros_args(sys.argv if args is None else args)
    return parser.parse_args(words[1:])


def ask_request(given: argparse.Namespace) -> Ask.Request:
    """Return the request that the command line describes."""
    return Ask.Request(
        question=given.ask_question,
        loud=given.ask_loud,
        weights=given.ask_weights,
    )


def dock_request(given: argparse.Namespace) -> Dock.Goal:
    """Return the goal that the command line describes."""
    return Dock.Goal(
        station=given.dock_station,
    )


def main(args: list[str] | None = None) -> int:
    """Do what the command line asks for; return 0 if it succeeded."""
    given = parse_arguments(args)
    with interruptible(args) as once:
        node = Both(given.server_timeout)
        once.run(node, node.call_ask, ask_request(given))
        once.run(node, node.send_dock, dock_request(given), node.cancel_dock)
    return once.status


if __name__ == '__main__':
    sys.exit(main())
