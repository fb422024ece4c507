"""The node countdown_action_server."""

from __future__ import annotations

from contextlib import suppress

from my_robot_controller.action import Countdown
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


class CountdownActionServer(Node):
    """
    The node countdown_action_server.

    It executes goals of countdown.
    """

    def __init__(self) -> None:
        """Create the node and its endpoints."""
        super().__init__('countdown_action_server')
        self.countdown_goal: ServerGoalHandle | None = None
        self.countdown_server = ActionServer(
            self,
            Countdown,
            'countdown',
            execute_callback=self.run_countdown_goal,
            goal_callback=self.accept_countdown_goal,
            handle_accepted_callback=self.begin_countdown_goal,
            cancel_callback=self.cancel_countdown_goal,
        )

    def accept_countdown_goal(self, goal: Countdown.Goal) -> GoalResponse:
        """Accept a goal for countdown, or reject an unreachable one."""
        return GoalResponse.ACCEPT if goal.target_count > 0 else GoalResponse.REJECT

    def begin_countdown_goal(self, goal_handle: ServerGoalHandle) -> None:
        """Start an accepted goal, which replaces the one before it."""
        before = self.countdown_goal
        if before is not None and before.is_active:
            self.get_logger().info('countdown: a newer goal takes over')
            before.abort()
        self.countdown_goal = goal_handle
        goal_handle.execute()

    def cancel_countdown_goal(self, goal_handle: ServerGoalHandle) -> CancelResponse:
        """Allow every goal to be cancelled."""
        self.get_logger().info('countdown: cancel requested')
        return CancelResponse.ACCEPT

    async def run_countdown_goal(
        self,
        goal_handle: ServerGoalHandle,
    ) -> Countdown.Result:
        """Execute a goal step by step, until it succeeds, is cancelled or is aborted."""
        goal: Countdown.Goal = goal_handle.request
        result = Countdown.Result(
            # The last number reached; 0 unless cancelled
            final_count=0,
            success=False,
        )
        self.get_logger().info(f'countdown: {goal.target_count=}')
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


def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init(args=args)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        try:
            executor = SingleThreadedExecutor()
            node = CountdownActionServer()
            executor.add_node(node)
            while ok():
                # not without end: rclpy can miss a signal that comes while it starts
                executor.spin_once(timeout_sec=1.0)
        except Exception:
            if ok():  # otherwise a signal shut rclpy down before the node was complete
                raise


if __name__ == '__main__':
    main()
