"""The node execute_task_server works on goals for execute_task."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from my_robot_controller.action import ExecuteTask
import rclpy
from rclpy.action.server import ActionServer, CancelResponse, GoalResponse, ServerGoalHandle
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future
from rclpy.utilities import ok, try_shutdown


class ExecuteTaskServer(Node):
    """The node execute_task_server works on goals for execute_task."""

    def __init__(self) -> None:
        """Create what the node consists of."""
        super().__init__('execute_task_server')
        self.execute_task_goal: ServerGoalHandle | None = None
        self.execute_task_server = ActionServer(
            self,
            ExecuteTask,
            'execute_task',
            execute_callback=self.execute_execute_task,
            goal_callback=self.accept_execute_task,
            handle_accepted_callback=self.begin_execute_task,
            cancel_callback=self.cancel_execute_task,
        )

    def accept_execute_task(self, goal: ExecuteTask.Goal) -> GoalResponse:
        """Accept a goal for execute_task, or reject one that cannot be reached."""
        return GoalResponse.ACCEPT if goal.task_name else GoalResponse.REJECT

    def begin_execute_task(self, goal_handle: ServerGoalHandle) -> None:
        """Begin to work on an accepted goal; it takes the place of the one before it."""
        before = self.execute_task_goal
        if before is not None and before.is_active:
            self.get_logger().info('execute_task: a newer goal takes over')
            before.abort()
        self.execute_task_goal = goal_handle
        goal_handle.execute()

    def cancel_execute_task(self, goal_handle: ServerGoalHandle) -> CancelResponse:
        """Let a goal be cancelled, whichever it is."""
        self.get_logger().info('execute_task: asked to cancel')
        return CancelResponse.ACCEPT

    async def execute_execute_task(self, goal_handle: ServerGoalHandle) -> ExecuteTask.Result:
        """Work on a goal, step by step, until it is reached, cancelled or given up."""
        result = ExecuteTask.Result(
            success=False,
        )
        goal: ExecuteTask.Goal = goal_handle.request
        self.get_logger().info(f'execute_task: task_name={goal.task_name!r}')
        for status in ('starting', 'working', 'finishing'):
            feedback = ExecuteTask.Feedback(
                # What the robot is doing now, for people to read
                current_status=f'{status}: {goal.task_name}',
            )
            goal_handle.publish_feedback(feedback)
            await self.pause(1.0)
            if not goal_handle.is_active:
                self.get_logger().info('execute_task: given up')
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
    """Run the node until it is asked to end."""
    try:
        rclpy.init(args=args)
        executor = SingleThreadedExecutor()
        node = ExecuteTaskServer()
        executor.add_node(node)
        # a signal that comes while rclpy starts can fail to wake it, so it waits a second at most
        while ok():
            executor.spin_once(timeout_sec=1.0)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except Exception:
        if ok():
            raise
        # otherwise it was asked to end before it was complete
    finally:
        try:
            try_shutdown()
        except RuntimeError:
            pass  # the signal that ended the node is shutting rclpy down at this very moment


if __name__ == '__main__':
    main()
