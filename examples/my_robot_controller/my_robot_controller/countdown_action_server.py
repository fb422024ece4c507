"""Executes countdown goals."""

from my_robot_controller.action import Countdown
import rclpy
from rclpy.action.server import ActionServer, CancelResponse, ServerGoalHandle
from rclpy.node import Node
from rclpy.task import Future
from rclpy.utilities import ok


class CountdownActionServer(Node):
    def __init__(self) -> None:
        super().__init__('countdown_action_server')
        self.countdown_server = ActionServer(
            self,
            Countdown,
            'countdown',
            self.execute_countdown,
            cancel_callback=lambda goal_handle: CancelResponse.ACCEPT,
        )

    async def execute_countdown(self, goal_handle: ServerGoalHandle) -> Countdown.Result:
        goal: Countdown.Goal = goal_handle.request
        self.get_logger().info(f'countdown: {goal.target_count=}')
        result = Countdown.Result(
            # The last number reached; 0 unless cancelled
            final_count=0,
            success=False,
        )
        for count in range(goal.target_count, 0, -1):
            feedback = Countdown.Feedback(current_count=count)
            goal_handle.publish_feedback(feedback)
            await self.pause(1.0)
            if goal_handle.is_cancel_requested:
                goal_handle.canceled()
                result.final_count = count
                self.get_logger().info('countdown: cancelled')
                return result
        goal_handle.succeed()
        result.success = True
        self.get_logger().info('countdown: done')
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
        rclpy.spin(CountdownActionServer())
    except BaseException as error:
        if ok() and not isinstance(error, KeyboardInterrupt):  # otherwise a signal ended it
            raise


if __name__ == '__main__':
    main()
