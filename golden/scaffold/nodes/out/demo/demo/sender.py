"""Sends dock goals."""

from typing import Any

from demo.action import Dock
import rclpy
from rclpy.action.client import ActionClient
from rclpy.node import Node
from rclpy.utilities import ok


class Sender(Node):
    def __init__(self) -> None:
        super().__init__('sender')
        self.dock_client = ActionClient(self, Dock, 'dock')

    def send_dock_goal(self, goal: Dock.Goal) -> None:
        while self.context.ok() and not self.dock_client.server_is_ready():
            self.get_logger().info('dock: waiting for a server')
            rclpy.spin_once(self, timeout_sec=1.0)
        sent = self.dock_client.send_goal_async(goal, feedback_callback=self.follow_dock_goal)
        rclpy.spin_until_future_complete(self, sent)
        if not sent.done():
            return
        if not sent.result().accepted:
            self.get_logger().error('dock: the goal was rejected')
            return
        ending = sent.result().get_result_async()
        rclpy.spin_until_future_complete(self, ending)
        if ending.done():
            result: Dock.Result = ending.result().result
            self.get_logger().info(f'dock: {result.docked=}')

    def follow_dock_goal(self, message: Any) -> None:
        feedback: Dock.Feedback = message.feedback
        self.get_logger().info(f'dock: {feedback.distance=}')


def main(args: list[str] | None = None) -> None:
    rclpy.init(args=args)
    try:
        node = Sender()
        node.send_dock_goal(Dock.Goal(station=1))
    except BaseException as error:
        if ok() and not isinstance(error, KeyboardInterrupt):  # otherwise a signal ended it
            raise


if __name__ == '__main__':
    main()
