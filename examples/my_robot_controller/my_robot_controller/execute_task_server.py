"""The node execute_task_server."""

from __future__ import annotations

from contextlib import suppress

from my_robot_controller.action import ExecuteTask
import rclpy
from rclpy.action.server import (
    ActionServer,
    CancelResponse,
    GoalResponse,
    ServerGoalHandle,
)
from rclpy.executors import (
    ExternalShutdownException,
    SingleThreadedExecutor,
)
from rclpy.node import Node
from rclpy.task import Future
from rclpy.utilities import ok


class ExecuteTaskServer(Node):
    """
    The node execute_task_server.

    Executes execute_task goals.
    """

    def __init__(self) -> None:
        """Create the node and its endpoints."""
        super().__init__('execute_task_server')
        self.execute_task_goal: ServerGoalHandle | None = None
        self.execute_task_server = ActionServer(
            self,
            ExecuteTask,
            'execute_task',
            execute_callback=self.run_execute_task_goal,
            goal_callback=self.accept_execute_task_goal,
            handle_accepted_callback=self.begin_execute_task_goal,
            cancel_callback=self.cancel_execute_task_goal,
        )

    def accept_execute_task_goal(self, goal: ExecuteTask.Goal) -> GoalResponse:
        """Accept a goal for execute_task, or reject an unreachable one."""
        return GoalResponse.ACCEPT if goal.task_name else GoalResponse.REJECT

    def begin_execute_task_goal(self, goal_handle: ServerGoalHandle) -> None:
        """Start an accepted goal, which replaces the one before it."""
        before = self.execute_task_goal
        if before is not None and before.is_active:
            self.get_logger().info('execute_task: a newer goal takes over')
            before.abort()
        self.execute_task_goal = goal_handle
        goal_handle.execute()

    def cancel_execute_task_goal(self, goal_handle: ServerGoalHandle) -> CancelResponse:
        """Allow every goal to be cancelled."""
        self.get_logger().info('execute_task: cancel requested')
        return CancelResponse.ACCEPT

    async def run_execute_task_goal(
        self,
        goal_handle: ServerGoalHandle,
    ) -> ExecuteTask.Result:
        """Execute a goal step by step, until it succeeds, is cancelled or is aborted."""
        goal: ExecuteTask.Goal = goal_handle.request
        result = ExecuteTask.Result(
            success=False,
        )
        self.get_logger().info(f'execute_task: {goal.task_name=}')
        for status in ('starting', 'working', 'finishing'):
            feedback = ExecuteTask.Feedback(
                # What the robot is doing now, for people to read
                current_status=f'{status}: {goal.task_name}',
            )
            goal_handle.publish_feedback(feedback)
            await self.pause(1.0)
            if not goal_handle.is_active:
                self.get_logger().info('execute_task: aborted')
                return result
            if goal_handle.is_cancel_requested:
                goal_handle.canceled()
                self.get_logger().info('execute_task: cancelled')
                return result
        goal_handle.succeed()
        result.success = True
        self.get_logger().info('execute_task: done')
        return result

    async def pause(self, seconds: float) -> None:
        """Wait without blocking: other callbacks run in the meantime."""
        over: Future = Future()
        timer = self.create_timer(seconds, lambda: over.set_result(None))
        await over
        self.destroy_timer(timer)


def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init(args=args)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        try:
            executor = SingleThreadedExecutor()
            node = ExecuteTaskServer()
            executor.add_node(node)
            while ok():
                # Wake up every second: rclpy can miss a signal that arrives during startup.
                executor.spin_once(timeout_sec=1.0)
        except Exception:
            if ok():  # otherwise a signal shut rclpy down before the node was complete
                raise


if __name__ == '__main__':
    main()
