"""The node station works on goals for dock."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from demo.action import Dock
import rclpy
from rclpy.action.server import ActionServer, CancelResponse, GoalResponse, ServerGoalHandle
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future
from rclpy.utilities import ok, try_shutdown


class Station(Node):
    """The node station works on goals for dock."""

    def __init__(self) -> None:
        """Create what the node consists of."""
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
        """Begin to work on an accepted goal; it takes the place of the one before it."""
        before = self.dock_goal
        if before is not None and before.is_active:
            self.get_logger().info('dock: a newer goal takes over')
            before.abort()
        self.dock_goal = goal_handle
        goal_handle.execute()

    def cancel_dock(self, goal_handle: ServerGoalHandle) -> CancelResponse:
        """Let a goal be cancelled, whichever it is."""
        self.get_logger().info('dock: asked to cancel')
        return CancelResponse.ACCEPT

    async def execute_dock(self, goal_handle: ServerGoalHandle) -> Dock.Result:
        """Work on a goal, step by step, until it is reached, cancelled or given up."""
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
                self.get_logger().info('dock: given up')
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
    """Run the node until it is asked to end."""
    try:
        rclpy.init(args=args)
        executor = SingleThreadedExecutor()
        node = Station()
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
