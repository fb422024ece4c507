"""The node station."""

from __future__ import annotations

from contextlib import suppress

from demo.action import Dock
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


class Station(Node):
    """
    The node station.

    It executes goals of dock.
    """

    def __init__(self) -> None:
        """Create the node and its endpoints."""
        super().__init__('station')
        self.dock_goal: ServerGoalHandle | None = None
        self.dock_server = ActionServer(
            self,
            Dock,
            'dock',
            execute_callback=self.run_dock_goal,
            goal_callback=self.accept_dock_goal,
            handle_accepted_callback=self.begin_dock_goal,
            cancel_callback=self.cancel_dock_goal,
        )

    def accept_dock_goal(self, goal: Dock.Goal) -> GoalResponse:
        """Accept a goal for dock, or reject an unreachable one."""
        return GoalResponse.ACCEPT

    def begin_dock_goal(self, goal_handle: ServerGoalHandle) -> None:
        """Start an accepted goal, which replaces the one before it."""
        before = self.dock_goal
        if before is not None and before.is_active:
            self.get_logger().info('dock: a newer goal takes over')
            before.abort()
        self.dock_goal = goal_handle
        goal_handle.execute()

    def cancel_dock_goal(self, goal_handle: ServerGoalHandle) -> CancelResponse:
        """Allow every goal to be cancelled."""
        self.get_logger().info('dock: cancel requested')
        return CancelResponse.ACCEPT

    async def run_dock_goal(
        self,
        goal_handle: ServerGoalHandle,
    ) -> Dock.Result:
        """Execute a goal step by step, until it succeeds, is cancelled or is aborted."""
        goal: Dock.Goal = goal_handle.request
        result = Dock.Result(
            docked=False,
        )
        self.get_logger().info(f'dock: {goal.station=}')
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


def main(args: list[str] | None = None) -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init(args=args)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        try:
            executor = SingleThreadedExecutor()
            node = Station()
            executor.add_node(node)
            while ok():
                # not without end: rclpy can miss a signal that comes while it starts
                executor.spin_once(timeout_sec=1.0)
        except Exception:
            if ok():  # otherwise a signal shut rclpy down before the node was complete
                raise


if __name__ == '__main__':
    main()
