"""A client that sends goals, follows them, cancels them, and gets their results."""

from __future__ import annotations

from collections.abc import Callable
from threading import Event
from typing import Any
from uuid import uuid4
from weakref import WeakValueDictionary

from idlc.robot.actions.goals import GoalState, id_of, result_of
from idlc.robot.names import action_names
from idlc.robot.nodes.interfaces import standard
from idlc.robot.nodes.tasks import Future
from idlc.robot.qos import (
    QoSProfile,
    qos_profile_action_status_default,
    qos_profile_default,
    qos_profile_services_default,
)


class ClientGoalHandle:
    """A goal that a server has answered; `accepted` is the answer, `stamp` its time."""

    def __init__(self, client: ActionClient, goal_id: Any, response: Any) -> None:
        self._client = client
        self.goal_id = goal_id
        self.accepted: bool = response.accepted
        self.stamp = response.stamp
        #: The last state that the server published, a number of action_msgs/msg/GoalStatus.
        self.status: int = GoalState.UNKNOWN

    def __repr__(self) -> str:
        key, state = id_of(self.goal_id).hex(), GoalState(self.status).name
        return f"ClientGoalHandle(id={key}, accepted={self.accepted}, status={state})"

    def cancel_goal_async(self) -> Future[Any]:
        """Ask the server to cancel the goal; the future has the action_msgs/srv/CancelGoal."""
        return self._client.cancel_async(self)

    def cancel_goal(self) -> Any:
        """Ask the server to cancel the goal, and wait; not in a callback."""
        return _wait(self.cancel_goal_async())

    def get_result_async(self) -> Future[Any]:
        """Ask for the result; the future has a response with `status` and `result`."""
        return self._client.get_result_async(self)

    def get_result(self) -> Any:
        """Ask for the result, and wait; not in a callback."""
        return _wait(self.get_result_async())


class ActionClient:
    """A client of an action."""

    def __init__(
        self,
        node: Any,
        action_type: Any,
        action_name: str,
        *,
        callback_group: Any = None,
        goal_service_qos_profile: QoSProfile = qos_profile_services_default,
        result_service_qos_profile: QoSProfile = qos_profile_services_default,
        cancel_service_qos_profile: QoSProfile = qos_profile_services_default,
        feedback_sub_qos_profile: QoSProfile = qos_profile_default,
        status_sub_qos_profile: QoSProfile = qos_profile_action_status_default,
    ) -> None:
        self._node = node
        self._type = action_type
        self._goals: WeakValueDictionary[bytes, ClientGoalHandle] = WeakValueDictionary()
        #: The states in the last message, which can arrive before the answer of the server.
        self._states: dict[bytes, int] = {}
        self._callbacks: dict[bytes, Callable[[Any], Any]] = {}
        self._names = names = action_names(node.resolve_service_name(action_name))
        impl = action_type.Impl
        self._cancel_type = standard("action_msgs/srv/CancelGoal").kind
        self._clients = [
            node.create_client(kind, name, qos_profile=qos, callback_group=callback_group)
            for kind, name, qos in (
                (impl.SendGoalService, names.send_goal, goal_service_qos_profile),
                (self._cancel_type, names.cancel_goal, cancel_service_qos_profile),
                (impl.GetResultService, names.get_result, result_service_qos_profile),
            )
        ]
        self._send, self._cancel, self._get_result = self._clients
        self._subscriptions = [
            node.create_subscription(kind, name, receive, qos, callback_group=callback_group)
            for kind, name, receive, qos in (
                (impl.FeedbackMessage, names.feedback, self._follow, feedback_sub_qos_profile),
                (
                    standard("action_msgs/msg/GoalStatusArray").kind,
                    names.status,
                    self._update,
                    status_sub_qos_profile,
                ),
            )
        ]

    def server_is_ready(self) -> bool:
        """Return whether all services and topics of a server are there."""
        return all(client.service_is_ready() for client in self._clients) and all(
            self._node.count_publishers(name) for name in (self._names.feedback, self._names.status)
        )

    def wait_for_server(self, timeout_sec: float | None = None) -> bool:
        """Wait until a server is there; return whether it is, for at most `timeout_sec` seconds."""
        return bool(
            self._node.session.graph.wait_for(lambda _: self.server_is_ready(), timeout_sec)
        )

    def send_goal_async(
        self,
        goal: Any,
        feedback_callback: Callable[[Any], Any] | None = None,
        goal_uuid: Any = None,
    ) -> Future[Any]:
        """Send a goal; the future has a ClientGoalHandle when the server has answered.

        `feedback_callback` gets messages with `feedback`. Raises TypeError if the goal is of
        another type.
        """
        if not isinstance(goal, self._type.Goal):
            raise TypeError(f"{goal!r} is not a {self._type.__name__}.Goal")
        request = self._type.Impl.SendGoalService.Request(goal=goal)
        request.goal_id.uuid = [*(uuid4().bytes if goal_uuid is None else goal_uuid.uuid)]
        key = id_of(request.goal_id)
        if feedback_callback is not None:
            self._callbacks[key] = feedback_callback

        def accepted(response: Any) -> ClientGoalHandle:
            handle = ClientGoalHandle(self, request.goal_id, response)
            if handle.accepted:
                self._goals[key] = handle
                handle.status = self._states.get(key, GoalState.ACCEPTED)
            else:
                self._callbacks.pop(key, None)
            return handle

        return _then(self._send.call_async(request), accepted)

    def send_goal(self, goal: Any, **options: Any) -> Any:
        """Send a goal, wait, and return the response with its result; not in a callback."""
        return _wait(self.send_goal_async(goal, **options)).get_result()

    def cancel_async(self, handle: ClientGoalHandle) -> Future[Any]:
        """Ask the server to cancel a goal."""
        request = self._cancel_type.Request()
        request.goal_info.goal_id.uuid = [*handle.goal_id.uuid]
        future: Future[Any] = self._cancel.call_async(request)
        return future

    def get_result_async(self, handle: ClientGoalHandle) -> Future[Any]:
        """Ask the server for the result of a goal."""
        request = self._type.Impl.GetResultService.Request()
        request.goal_id.uuid = [*handle.goal_id.uuid]

        def ended(response: Any) -> Any:
            self._callbacks.pop(id_of(handle.goal_id), None)
            return response

        return _then(self._get_result.call_async(request), ended)

    def destroy(self) -> None:
        """Remove the clients and subscriptions."""
        for client in self._clients:
            self._node.destroy_client(client)
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)

    async def _follow(self, message: Any) -> None:
        if callback := self._callbacks.get(id_of(message.goal_id)):
            await result_of(callback(message))

    def _update(self, message: Any) -> None:
        self._states = {
            id_of(each.goal_info.goal_id): each.status
            for each in message.status_list
            if GoalState.UNKNOWN < each.status <= GoalState.ABORTED
        }
        for key, handle in [*self._goals.items()]:
            handle.status = self._states.get(key, handle.status)


def _then(future: Future[Any], change: Callable[[Any], Any]) -> Future[Any]:
    """Return a future with the changed result of another one."""
    changed: Future[Any] = Future()

    def done(future: Future[Any]) -> None:
        if changed.done():
            return
        error = future.exception()
        if error is not None:
            changed.set_exception(error)
        elif future.cancelled():
            changed.cancel()
        else:
            changed.set_result(change(future.result()))

    future.add_done_callback(done)
    return changed


def _wait(future: Future[Any]) -> Any:
    done = Event()
    future.add_done_callback(lambda _: done.set())
    done.wait()
    return future.result()
