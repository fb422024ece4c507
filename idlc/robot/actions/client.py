"""A client that sends goals, gets their feedback and results, and cancels them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any
from uuid import uuid4

from idlc.robot.names import action_names
from idlc.robot.nodes.executor import Future
from idlc.robot.nodes.interfaces import standard
from idlc.robot.nodes.services import Client
from idlc.robot.qos import qos_profile_action_status_default


class ClientGoalHandle:
    """A goal that a server has answered; `accepted` is the answer, `stamp` its time."""

    def __init__(self, client: ActionClient, goal_id: Any, response: Any) -> None:
        self._client = client
        self.goal_id = goal_id
        self.accepted: bool = response.accepted
        self.stamp = response.stamp

    def cancel_goal_async(self) -> Future[Any]:
        """Ask the server to cancel the goal; the future has the action_msgs/srv/CancelGoal."""
        request = self._client.cancel_client.interface.kind.Request()
        request.goal_info.goal_id.uuid = [*self.goal_id.uuid]
        return self._client.cancel_client.call_async(request)

    def get_result_async(self) -> Future[Any]:
        """Ask for the result; the future has a response with `status` and `result`."""
        request = self._client.result_client.interface.kind.Request(goal_id=self.goal_id)
        future = self._client.result_client.call_async(request)
        callbacks = self._client.feedback_callbacks
        future.add_done_callback(lambda _: callbacks.pop(bytes(self.goal_id.uuid), None))
        return future


class ActionClient:
    """A client of an action."""

    def __init__(
        self, node: Any, action_type: Any, action_name: str, *, callback_group: Any = None
    ) -> None:
        self._node = node
        self._type = action_type
        self.feedback_callbacks: dict[bytes, Callable[[Any], Any] | None] = {}
        names = action_names(node.resolve_service_name(action_name))
        impl = action_type.Impl
        # in the order of rclpy, so that ids are equal
        client = node.create_client
        cancel_type = standard("action_msgs/srv/CancelGoal").kind
        self._send: Client[Any, Any] = client(impl.SendGoalService, names.send_goal)
        self.cancel_client: Client[Any, Any] = client(cancel_type, names.cancel_goal)
        self.result_client: Client[Any, Any] = client(impl.GetResultService, names.get_result)
        self._clients = (self._send, self.cancel_client, self.result_client)
        subscribe = partial(node.create_subscription, callback_group=callback_group)
        status_type = standard("action_msgs/msg/GoalStatusArray").kind
        status_qos = qos_profile_action_status_default
        # the states of goals are ignored; their publisher shows that there is a server
        self._subscriptions = (
            subscribe(impl.FeedbackMessage, names.feedback, self._follow, 10),
            subscribe(status_type, names.status, lambda _: None, status_qos),
        )

    def server_is_ready(self) -> bool:
        """Return whether all services and topics of a server are there."""
        return all(client.service_is_ready() for client in self._clients) and all(
            subscription.get_publisher_count() for subscription in self._subscriptions
        )

    def wait_for_server(self, timeout_sec: float | None = None) -> bool:
        """Wait until a server is there; return whether it is, for at most `timeout_sec` seconds."""
        return bool(self._node.graph.wait_for(lambda _: self.server_is_ready(), timeout_sec))

    def send_goal_async(
        self, goal: Any, feedback_callback: Callable[[Any], Any] | None = None
    ) -> Future[ClientGoalHandle]:
        """Send a goal; the future has a ClientGoalHandle when the server has answered.

        `feedback_callback` gets messages with `feedback`. Raises TypeError if the goal is of
        another type.
        """
        if not isinstance(goal, self._type.Goal):
            raise TypeError(f"{goal!r} is not a {self._type.__name__}.Goal")
        request = self._type.Impl.SendGoalService.Request(goal=goal)
        request.goal_id.uuid = [*uuid4().bytes]
        key = bytes(request.goal_id.uuid)
        self.feedback_callbacks[key] = feedback_callback
        sent: Future[ClientGoalHandle] = Future()

        def answer(future: Future[Any]) -> None:
            accepted = False
            if (error := future.exception()) is not None:
                sent.set_exception(error)
            elif future.cancelled():
                sent.cancel()
            else:
                handle = ClientGoalHandle(self, request.goal_id, future.result())
                accepted = handle.accepted
                sent.set_result(handle)
            if not accepted:
                self.feedback_callbacks.pop(key, None)

        self._send.call_async(request).add_done_callback(answer)
        return sent

    def destroy(self) -> None:
        """Remove the clients and subscriptions."""
        for endpoint in (*self._clients, *self._subscriptions):
            self._node.destroy_client(endpoint)

    def _follow(self, message: Any) -> Any:
        callback = self.feedback_callbacks.get(bytes(message.goal_id.uuid))
        return callback and callback(message)
