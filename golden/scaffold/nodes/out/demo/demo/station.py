"""Executes dock goals."""

from demo.action import Dock
import rclpy
from rclpy.action.server import ActionServer, CancelResponse, ServerGoalHandle
from rclpy.node import Node
from rclpy.task import Future
from rclpy.utilities import ok


class Station(Node):
    def __init__(self) -> None:
        super().__init__('station')
        self.dock_server = ActionServer(
            self,
            Dock,
            'dock',
            self.execute_dock,
            cancel_callback=lambda goal_handle: CancelResponse.ACCEPT,
        )

    async def execute_dock(self, goal_handle: ServerGoalHandle) -> Dock.Result:
        goal: Dock.Goal = goal_handle.request
        self.get_logger().info(f'dock: {goal.station=}')
        result = Dock.Result(docked=False)
        for _ in range(5):
            feedback = Dock.Feedback(
                # to go [m]
                distance=0.0,
            )
            goal_handle.publish_feedback(feedback)
            await self.pause(1.0)
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
    rclpy.init(args=args)
    try:
        rclpy.spin(Station())
    except BaseException as error:
        if ok() and not isinstance(error, KeyboardInterrupt):  # otherwise a signal ended it
            raise


if __name__ == '__main__':
    main()
