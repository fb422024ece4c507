"""Sends countdown goals."""

import sys
from typing import Any

from my_robot_controller.action import Countdown
import rclpy
from rclpy.action.client import ActionClient
from rclpy.node import Node
from rclpy.utilities import ok


class CountdownActionClient(Node):
    def __init__(self) -> None:
        super().__init__('countdown_action_client')
        self.countdown_client = ActionClient(self, Countdown, 'countdown')

    def send_countdown_goal(self, goal: Countdown.Goal) -> None:
        while self.context.ok() and not self.countdown_client.server_is_ready():
            self.get_logger().info('countdown: waiting for a server')
            rclpy.spin_once(self, timeout_sec=1.0)
        sent = self.countdown_client.send_goal_async(
            goal, feedback_callback=self.follow_countdown_goal
        )
        rclpy.spin_until_future_complete(self, sent)
        if not sent.done():
            return
        if not sent.result().accepted:
            self.get_logger().error('countdown: the goal was rejected')
            return
        ending = sent.result().get_result_async()
        rclpy.spin_until_future_complete(self, ending)
        if ending.done():
            result: Countdown.Result = ending.result().result
            self.get_logger().info(f'countdown: {result=}')

    def follow_countdown_goal(self, message: Any) -> None:
        feedback: Countdown.Feedback = message.feedback
        self.get_logger().info(f'countdown: {feedback.current_count=}')


def main(args: list[str] | None = None) -> None:
    rclpy.init(args=args)
    try:
        count = int(sys.argv[1]) if len(sys.argv) > 1 else 5
        node = CountdownActionClient()
        node.send_countdown_goal(
            Countdown.Goal(
                # Where to start counting down
                target_count=count,
            ),
        )
    except BaseException as error:
        if ok() and not isinstance(error, KeyboardInterrupt):  # otherwise a signal ended it
            raise


if __name__ == '__main__':
    main()
