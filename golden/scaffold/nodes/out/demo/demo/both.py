"""The node both calls ask and sends goals to dock."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

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
from rclpy.action.client import ActionClient, ClientGoalHandle
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from rclpy.utilities import remove_ros_args, try_shutdown


class Both(Node):
    """The node both calls ask and sends goals to dock."""

    def __init__(self, timeout: float) -> None:
        """Create what the node consists of."""
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
        """Act on what the server reports about the goal."""
        feedback: Dock.Feedback = message.feedback
        self.get_logger().info(f'dock: distance={feedback.distance!r}')

    async def cancel_dock(self) -> None:
        """Ask the server to cancel the goal that it was sent."""
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
    """Return what the command line says, ROS 2's own arguments left out."""
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
    """Return the request that the command line asks for."""
    return Ask.Request(
        question=given.ask_question,
        loud=given.ask_loud,
        weights=given.ask_weights,
    )


def dock_request(given: argparse.Namespace) -> Dock.Goal:
    """Return the goal that the command line asks for."""
    return Dock.Goal(
        station=given.dock_station,
    )


def main(args: list[str] | None = None) -> int:
    """Do what the command line asks for; return 0 if all went well."""
    given = parse_arguments(args)
    interrupted = Event()
    for one in (signal.SIGINT, signal.SIGTERM):
        signal.signal(one, lambda *_: interrupted.set())
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        executor = SingleThreadedExecutor()
        node = Both(given.server_timeout)
        executor.add_node(node)
        well = True
        task = executor.create_task(node.call_ask, ask_request(given))
        while not (task.done() or interrupted.is_set()):
            executor.spin_once(timeout_sec=0.1)
        well = well and bool(task.result())
        task = executor.create_task(node.send_dock, dock_request(given))
        while not (task.done() or interrupted.is_set()):
            executor.spin_once(timeout_sec=0.1)
        well = well and bool(task.result())
        if interrupted.is_set():
            executor.spin_until_future_complete(executor.create_task(node.cancel_dock))
        return 130 if interrupted.is_set() else 0 if well else 1
    except ExternalShutdownException:
        return 1
    finally:
        try_shutdown()


if __name__ == '__main__':
    sys.exit(main())
