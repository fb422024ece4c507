"""Sends goals to execute_task."""

from typing import Any

from my_robot_controller.action import ExecuteTask
import rclpy
from rclpy.action.client import ActionClient
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.utilities import ok


class ExecuteTaskClient(Node):
    def __init__(self) -> None:
        super().__init__('execute_task_client')
        self.execute_task_client = ActionClient(self, ExecuteTask, 'execute_task')

    def send_execute_task_goal(self, goal: ExecuteTask.Goal) -> None:
        while self.context.ok() and not self.execute_task_client.server_is_ready():
            self.get_logger().info('execute_task: waiting for a server')
            rclpy.spin_once(self, timeout_sec=1.0)
        sent = self.execute_task_client.send_goal_async(
            goal, feedback_callback=self.follow_execute_task_goal
        )
        rclpy.spin_until_future_complete(self, sent)
        if not sent.done():
            return
        if not sent.result().accepted:
            self.get_logger().error('execute_task: the goal was rejected')
            return
        ending = sent.result().get_result_async()
        rclpy.spin_until_future_complete(self, ending)
        if ending.done():
            result: ExecuteTask.Result = ending.result().result
            self.get_logger().info(f'execute_task: {result.success=}')

    def follow_execute_task_goal(self, message: Any) -> None:
        feedback: ExecuteTask.Feedback = message.feedback
        self.get_logger().info(f'execute_task: {feedback.current_status=}')


def main(args: list[str] | None = None) -> None:
    rclpy.init(args=args)
    try:
        node = ExecuteTaskClient()
        node.send_execute_task_goal(
            ExecuteTask.Goal(
                # The task to execute, e.g. "dock"
                task_name='dock',
            ),
        )
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except Exception:
        if ok():  # otherwise a signal has shut rclpy down
            raise


if __name__ == '__main__':
    main()
