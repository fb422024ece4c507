"""The node execute_task_client sends goals to execute_task."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

import argparse
from collections.abc import Callable
import sys
import time
from typing import Any

from action_msgs.msg import GoalStatus
from my_robot_controller.action import ExecuteTask
from my_robot_controller.node_main import interruptible
from rclpy.action.client import ActionClient, ClientGoalHandle
from rclpy.node import Node
from rclpy.task import Future
from rclpy.utilities import remove_ros_args


class ExecuteTaskClient(Node):
    """The node execute_task_client sends goals to execute_task."""

    def __init__(self, timeout: float) -> None:
        """Create the node and its endpoints."""
        super().__init__('execute_task_client')
        self.timeout = timeout
        self.execute_task_sent: Future | None = None
        self.execute_task_client = ActionClient(self, ExecuteTask, 'execute_task')

    async def send_execute_task(self, goal: ExecuteTask.Goal) -> bool:
        """Send a goal to execute_task; return whether it was reached."""
        if not await self.until(self.execute_task_client.server_is_ready):
            self.get_logger().error('execute_task: gave up waiting for a server')
            return False
        sent = self.execute_task_client.send_goal_async(
            goal,
            feedback_callback=self.follow_execute_task,
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
        self.get_logger().info(f'execute_task: success={result.success!r}')
        return bool(ending.result().status == GoalStatus.STATUS_SUCCEEDED)

    def follow_execute_task(self, message: Any) -> None:
        """Log the feedback that the server sends about the goal."""
        feedback: ExecuteTask.Feedback = message.feedback
        self.get_logger().info(f'execute_task: current_status={feedback.current_status!r}')

    async def cancel_execute_task(self) -> None:
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
        description='The node execute_task_client sends goals to execute_task.',
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


def execute_task_request(given: argparse.Namespace) -> ExecuteTask.Goal:
    """Return the goal that the command line describes."""
    return ExecuteTask.Goal(
        task_name=given.task_name,
    )


def main(args: list[str] | None = None) -> int:
    """Do what the command line asks for; return 0 if it succeeded."""
    given = parse_arguments(args)
    with interruptible(args) as once:
        node = ExecuteTaskClient(given.server_timeout)
        once.run(
            node,
            node.send_execute_task,
            execute_task_request(given),
            node.cancel_execute_task,
        )
    return once.status


if __name__ == '__main__':
    sys.exit(main())
