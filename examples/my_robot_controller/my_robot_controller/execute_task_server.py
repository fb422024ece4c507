"""Executes goals of execute_task."""

from my_robot_controller.action import ExecuteTask
import rclpy
from rclpy.action.server import ActionServer, CancelResponse, ServerGoalHandle
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.task import Future


class ExecuteTaskServer(Node):
    def __init__(self) -> None:
        super().__init__('execute_task_server')
        self.execute_task_server = ActionServer(
            self,
            ExecuteTask,
            'execute_task',
            self.execute_execute_task,
            cancel_callback=lambda goal_handle: CancelResponse.ACCEPT,
        )

    async def execute_execute_task(self, goal_handle: ServerGoalHandle) -> ExecuteTask.Result:
        goal: ExecuteTask.Goal = goal_handle.request
        self.get_logger().info(f'execute_task: {goal.task_name=}')
        result = ExecuteTask.Result(success=False)
        for status in ('starting', 'working', 'finishing'):
            feedback = ExecuteTask.Feedback(
                # What the robot is doing now, for people to read
                current_status=f'{status}: {goal.task_name}',
            )
            goal_handle.publish_feedback(feedback)
            await self.pause(1.0)
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
    rclpy.init(args=args)
    try:
        rclpy.spin(ExecuteTaskServer())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == '__main__':
    main()
