"""The node station works on goals for dock."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from demo.action import Dock
from demo.node_main import until_shutdown, WakingExecutor
import rclpy
from rclpy.action.server import ActionServer, CancelResponse, GoalResponse, ServerGoalHandle
from rclpy.node import Node
from rclpy.task import Future


class Station(Node):
    """The node station works on goals for dock."""

    def __init__(self) -> None:
        """Create the node and its endpoints."""
        super().__init__('station')
        self.dock_goal: ServerGoalHandle | None = None
        self.dock_server = ActionServer(
            self,
            Dock,
            'dock',
            execute_callback=self.execute_dock,
            goal_callback=self.accept_dock,
            handle_accepted_callback=self.begin_dock,
            cancel_callback=self.cancel_dock,
        )

    def accept_dock(self, goal: Dock.Goal) -> GoalResponse:
        """Accept a goal for dock, or reject one that cannot be reached."""
        return GoalResponse.ACCEPT

    def begin_dock(self, goal_handle: ServerGoalHandle) -> None:
        """Start an accepted goal, which replaces the one before it."""
        before = self.dock_goal
        if before is not None and before.is_active:
            self.get_logger().info('dock: a newer goal takes over')
            before.abort()
        self.dock_goal = goal_handle
        goal_handle.execute()

    def cancel_dock(self, goal_handle: ServerGoalHandle) -> CancelResponse:
        """Allow every goal to be cancelled."""
        self.get_logger().info('dock: cancel requested')
        return CancelResponse.ACCEPT

    async def execute_dock(self, goal_handle: ServerGoalHandle) -> Dock.Result:
        """Work on a goal step by step, until it succeeds or is cancelled or aborted."""
        result = Dock.Result(
            docked=False,
        )
        goal: Dock.Goal = goal_handle.request
        self.get_logger().info(f'dock: station={goal.station!r}')
        for _ in range(5):
            feedback = Dock.Feedback(
                # to go [m]
                distance=0.0,
            )
            goal_handle.publish_feedback(feedback)
            await self.pause(1.0)
            if not goal_handle.is_active:
                self.get_logger().info('dock: aborted')
                return result
            if goal_handle.is_cancel_requested:
                goal_handle.canceled()
                self.get_logger().info('dock: cancelled')
                return result
        goal_handle.succeed()
        self.get_logger().info('dock: done')
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
    node = Station()
    executor = WakingExecutor()
    rclpy.spin(node, executor)


if __name__ == '__main__':
    main()
