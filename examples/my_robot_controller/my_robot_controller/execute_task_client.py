"""The node execute_task_client."""

from __future__ import annotations

import argparse
from collections.abc import Callable
import signal
import sys
from threading import Event
import time
from typing import Any

from action_msgs.msg import GoalStatus
from my_robot_controller.action import ExecuteTask
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


class ExecuteTaskClient(Node):
    """
    The node execute_task_client.

    Sends execute_task goals.
    """

    def __init__(self, timeout: float) -> None:
        """Create the node and its endpoints."""
        super().__init__('execute_task_client')
        self.timeout = timeout
        self.execute_task_sent: Future | None = None
        self.execute_task_client = ActionClient(
            self,
            ExecuteTask,
            'execute_task',
        )

    async def send_execute_task_goal(self, goal: ExecuteTask.Goal) -> bool:
        """Send a goal to execute_task; return whether it was reached."""
        if not await self.until(self.execute_task_client.server_is_ready):
            self.get_logger().error('execute_task: gave up waiting for a server')
            return False
        sent = self.execute_task_client.send_goal_async(
            goal,
            feedback_callback=self.follow_execute_task_goal,
        )
        self.execute_task_sent = sent
        if not await self.until(sent.done):
            self.get_logger().error('execute_task: gave up waiting for an answer')
            return False
        goal_handle: ClientGoalHandle = sent.result()
        if not goal_handle.accepted:
            self.get_logger().error('execute_task: the goal was rejected')
            return False
        ending = goal_handle.get_result_async()
        while not ending.done():
            if not self.execute_task_client.server_is_ready():
                self.get_logger().error('execute_task: the server has gone')
                return False
            await self.pause(0.05)
        self.execute_task_sent = None
        result: ExecuteTask.Result = ending.result().result
        self.get_logger().info(f'execute_task: {result.success=}')
        return bool(ending.result().status == GoalStatus.STATUS_SUCCEEDED)

    def follow_execute_task_goal(self, message: Any) -> None:
        """Log the feedback that the server sends about the goal."""
        feedback: ExecuteTask.Feedback = message.feedback
        self.get_logger().info(f'execute_task: {feedback.current_status=}')

    async def cancel_execute_task_goal(self) -> None:
        """Ask the server to cancel the goal."""
        sent = self.execute_task_sent
        if sent is not None and await self.until(sent.done):
            answer = sent.result().cancel_goal_async()
            if await self.until(answer.done):
                self.get_logger().info('execute_task: cancelled')

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
        description=ExecuteTaskClient.__doc__,
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
        'task_name',
        type=str,
        nargs='?',
        default='dock',
        help='The task to execute, e.g. "dock"',
    )
    words = remove_ros_args(sys.argv if args is None else args)
    return parser.parse_args(words[1:])


def execute_task_request(options: argparse.Namespace) -> ExecuteTask.Goal:
    """Return the goal that the command line describes."""
    return ExecuteTask.Goal(
        task_name=options.task_name,
    )


def main(args: list[str] | None = None) -> int:
    """Send the goal; return 0 if it succeeded."""
    options = parse_arguments(args)
    interrupted = Event()
    # not by rclpy, which would shut down before goals are cancelled
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: interrupted.set())
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    node = ExecuteTaskClient(options.server_timeout)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    tasks = [
        executor.create_task(
            node.send_execute_task_goal,
            execute_task_request(options),
        ),
    ]
    while ok() and not interrupted.is_set() and not all(task.done() for task in tasks):
        executor.spin_once(timeout_sec=0.1)
    if interrupted.is_set():
        task = executor.create_task(node.cancel_execute_task_goal)
        executor.spin_until_future_complete(task)
    try_shutdown()
    if interrupted.is_set():
        return 130
    return 0 if all(task.result() for task in tasks) else 1


if __name__ == '__main__':
    sys.exit(main())
