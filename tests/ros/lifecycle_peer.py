"""A node that speaks to a scaffolded lifecycle node; in a module of its own for what it imports."""

import time

import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.action import ActionClient, ActionServer, CancelResponse
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future
from std_msgs.msg import Empty
from test_msgs.action import Fibonacci

from tests.support.waiting import wait_for


class Peer:
    """A node beside the worker: everything that it speaks to, and what came of that."""

    def __init__(self, context: Context, watched: set[str]) -> None:
        self.node = rclpy.create_node("peer", context=context)
        self.executor = SingleThreadedExecutor(context=context)
        self.executor.add_node(self.node)
        self.watched = watched
        self.messages = 0
        self.cancelled = False
        self.node.create_subscription(Empty, "out", self._count, 10)
        self.client = ActionClient(self.node, Fibonacci, "work")
        self.server = ActionServer(
            self.node, Fibonacci, "sent", self._never_done, cancel_callback=self._cancel
        )
        self.change = self.node.create_client(ChangeState, "worker/change_state")
        self.state = self.node.create_client(GetState, "worker/get_state")

    def _count(self, _message):
        self.messages += 1

    def _cancel(self, _goal_handle):
        self.cancelled = True
        return CancelResponse.ACCEPT

    async def _never_done(self, _goal_handle):
        await Future()

    def spin(self, seconds):
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self.executor.spin_once(timeout_sec=0.05)

    def until(self, condition):
        wait_for(condition, between=lambda: self.executor.spin_once(timeout_sec=0.05))

    def result(self, future):
        self.until(future.done)
        return future.result()

    def step(self, *transitions):
        """Take the worker through transitions; return whether the last one succeeded."""
        self.until(self.change.service_is_ready)
        for one in transitions:
            request = ChangeState.Request(transition=Transition(id=one))
            success = self.result(self.change.call_async(request)).success
        return success

    def state_of_worker(self):
        self.until(self.state.service_is_ready)
        return self.result(self.state.call_async(GetState.Request())).current_state.label

    def offered(self):
        """Return the names of the worker's topics, services and clients that are watched."""
        if "worker" not in self.node.get_node_names():
            return set()  # not discovered yet
        ask = (
            self.node.get_publisher_names_and_types_by_node,
            self.node.get_subscriber_names_and_types_by_node,
            self.node.get_service_names_and_types_by_node,
            self.node.get_client_names_and_types_by_node,
        )
        return self.watched & {name for one in ask for name, _ in one("worker", "/")}
