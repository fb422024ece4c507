"""The node countdown_action_server works on goals for countdown."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from my_robot_controller.action import Countdown
from my_robot_controller.node_main import until_shutdown, WakingExecutor
import rclpy
from rclpy.action.server import ActionServer, CancelResponse, GoalResponse, ServerGoalHandle
from rclpy.node import Node
from rclpy.task import Future


class CountdownActionServer(Node):
    """The node countdown_action_server works on goals for countdown."""

    def __init__(self) -> None:
        """Create the node and its endpoints."""
        super().__init__('countdown_action_server')
        self.countdown_goal: ServerGoalHandle | None = None
        self.countdown_server = ActionServer(
            self,
            Countdown,
            'countdown',
            execute_callback=self.execute_countdown,
            goal_callback=self.accept_countdown,
            handle_accepted_callback=self.begin_countdown,
            cancel_callback=self.cancel_countdown,
        )

    def accept_countdown(self, goal: Countdown.Goal) -> GoalResponse:
        """Accept a goal for countdown, or reject one that cannot be reached."""
        return GoalResponse.ACCEPT if goal.target_count > 0 else GoalResponse.REJECT

    def begin_countdown(self, goal_handle: ServerGoalHandle) -> None:
        """Start an accepted goal, which replaces the one before it."""
        before = self.countdown_goal
        if before is not None and before.is_active:
            self.get_logger().info('countdown: a newer goal takes over')
            before.abort()
        self.countdown_goal = goal_handle
        goal_handle.execute()

    def cancel_countdown(self, goal_handle: ServerGoalHandle) -> CancelResponse:
        """Allow every goal to be cancelled."""
        self.get_logger().info('countdown: cancel requested')
        return CancelResponse.ACCEPT

    async def execute_countdown(self, goal_handle: ServerGoalHandle) -> Countdown.Result:
        """Work on a goal step by step, until it succeeds or is cancelled or aborted."""
        result = Countdown.Result(
            # The last number reached; 0 unless cancelled
            final_count=0,
            success=False,
        )
        goal: Countdown.Goal = goal_handle.request
        self.get_logger().info(f'countdown: target_count={goal.target_count!r}')
        for count in range(goal.target_count, 0, -1):
            feedback = Countdown.Feedback(
                current_count=count,
            )
            goal_handle.publish_feedback(feedback)
            await self.pause(1.0)
            if not goal_handle.is_active:
                self.get_logger().info('countdown: aborted')
                return result
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


@until_shutdown
def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init(args=args)
    node = CountdownActionServer()
    executor = WakingExecutor()
    rclpy.spin(node, executor)


if __name__ == '__main__':
    main()
