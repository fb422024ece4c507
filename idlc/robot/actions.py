"""Actions: servers that execute goals, and clients that send them, in the words of rclpy."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from enum import Enum, IntEnum
from functools import partial
from inspect import isawaitable
from threading import RLock
from time import monotonic
from traceback import format_exc
from typing import Any, TypeAlias
from uuid import uuid4

from idlc.robot.errors import RobotError
from idlc.robot.names import action_names
from idlc.robot.nodes.executor import Future, ReentrantCallbackGroup
from idlc.robot.nodes.interfaces import standard
from idlc.robot.nodes.services import Client
from idlc.robot.qos import qos_profile_action_status_default


class GoalState(IntEnum):
    """The state of a goal; the numbers are those of action_msgs/msg/GoalStatus."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6


#: The states of goals that have not ended, and the states that can follow.
_NEXT: dict[GoalState, tuple[GoalState, ...]] = {
    GoalState.ACCEPTED: (GoalState.EXECUTING, GoalState.CANCELING),
    GoalState.EXECUTING: (GoalState.CANCELING, GoalState.SUCCEEDED, GoalState.ABORTED),
    GoalState.CANCELING: (GoalState.CANCELED, GoalState.SUCCEEDED, GoalState.ABORTED),
}

#: The answer to a new goal.
GoalResponse = Enum("GoalResponse", "REJECT ACCEPT")
#: The answer to a request to cancel a goal.
CancelResponse = Enum("CancelResponse", "REJECT ACCEPT")


class ServerGoalHandle:
    """A goal that the server accepted; `status` is a number of action_msgs/msg/GoalStatus."""

    def __init__(self, server: ActionServer, request: Any, stamp: Any) -> None:
        self._server = server
        self.request = request.goal
        self.goal_id = request.goal_id
        self.info = standard("action_msgs/msg/GoalInfo").kind(goal_id=request.goal_id, stamp=stamp)
        self.status = GoalState.ACCEPTED
        self.ended_at = math.inf
        #: It ends with the response to clients that ask for the result.
        self.response: Future[Any] = Future()

    @property
    def is_active(self) -> bool:
        """True until the goal has succeeded or aborted, or is canceled."""
        return self.status in _NEXT

    @property
    def is_cancel_requested(self) -> bool:
        """True if the server accepted a client's request to cancel."""
        return self.status is GoalState.CANCELING

    def execute(self) -> None:
        """Execute the goal soon, by the callback of the server."""
        if not self.is_cancel_requested:
            self.enter(GoalState.EXECUTING)
        self._server.start(self)

    def publish_feedback(self, feedback: Any) -> None:
        """Send feedback to the clients.

        Raises TypeError if it is of another type, and RobotError after Ctrl-C, which ends the goal.
        """
        publisher = self._server.feedback_publisher
        if not publisher.node.context.ok():
            raise RobotError("the context is shut down")
        _check_type(feedback, self._server.action_type, "Feedback")
        publisher.publish(publisher.interface.kind(goal_id=self.goal_id, feedback=feedback))

    def succeed(self) -> None:
        """End the goal as reached; raise RuntimeError if it is neither executed nor canceled."""
        self.enter(GoalState.SUCCEEDED)

    def abort(self) -> None:
        """End the goal as failed; raise RuntimeError if it is neither executed nor canceled."""
        self.enter(GoalState.ABORTED)

    def canceled(self) -> None:
        """End the goal as canceled; raise RuntimeError if no client asked for that."""
        self.enter(GoalState.CANCELED)

    def enter(self, state: GoalState) -> None:
        """Change the state, and publish it; raise RuntimeError if it cannot follow."""
        with self._server.lock:
            if state not in _NEXT.get(self.status, ()):
                raise RuntimeError(f"a goal that is {self.status.name} cannot become {state.name}")
            self.status = state
            if not self.is_active:
                self.ended_at = monotonic()
            self._server.publish_status()


GoalCallback: TypeAlias = Callable[[ServerGoalHandle], Any]


class ActionServer:
    """A server of an action.

    `execute_callback` gets a ServerGoalHandle and returns a result, `goal_callback` gets a goal and
    returns a GoalResponse, `cancel_callback` gets the handle and returns a CancelResponse. They may
    be coroutines. Without them, the server accepts all goals, and rejects requests to cancel.
    `handle_accepted_callback` gets the handle, and executes the goal at some time. Results are kept
    for `result_timeout` seconds, for ever if it is negative.
    """

    def __init__(
        self,
        node: Any,
        action_type: Any,
        action_name: str,
        execute_callback: GoalCallback,
        *,
        callback_group: Any = None,
        goal_callback: Callable[[Any], Any] | None = None,
        handle_accepted_callback: GoalCallback | None = None,
        cancel_callback: GoalCallback | None = None,
        result_timeout: float = 900,
    ) -> None:
        if not callable(execute_callback):
            raise TypeError(f"execute_callback is not callable: {execute_callback!r}")
        self.action_type = action_type
        self._node = node
        self._logger = node.get_logger().get_child("action_server")
        self._execute_callback = execute_callback
        self._goal_callback = goal_callback or (lambda _: GoalResponse.ACCEPT)
        self._accepted_callback = handle_accepted_callback or ServerGoalHandle.execute
        self._cancel_callback = cancel_callback or (lambda _: CancelResponse.REJECT)
        self._timeout = result_timeout if result_timeout >= 0 else math.inf
        self._goals: dict[bytes, ServerGoalHandle] = {}
        #: For the states of goals, which are published in the order in which they change.
        self.lock = RLock()
        names, impl = action_names(node.resolve_service_name(action_name)), action_type.Impl
        serve = partial(node.create_service, callback_group=callback_group)
        # requests for results wait until goals end
        serve_result = partial(node.create_service, callback_group=ReentrantCallbackGroup())
        states, qos = standard("action_msgs/msg/GoalStatusArray"), qos_profile_action_status_default
        # in the order of rclpy, so that ids are equal; goals that arrive meanwhile wait
        with self.lock:
            self._services = (
                serve(impl.SendGoalService, names.send_goal, self._accept),
                serve(standard("action_msgs/srv/CancelGoal"), names.cancel_goal, self._cancel),
                serve_result(impl.GetResultService, names.get_result, self._answer_result),
            )
            self._services[0].after_response = self._begin
            publish = node.create_publisher
            self.feedback_publisher = publish(impl.FeedbackMessage, names.feedback, 10)
            self._status = publish(states, names.status, qos)

    def destroy(self) -> None:
        """Remove the services and topics; goals that are executed go on unseen."""
        for endpoint in (*self._services, self.feedback_publisher, self._status):
            self._node.destroy_service(endpoint)

    # for handles of goals

    def publish_status(self) -> None:
        """Publish the states of all goals."""
        with self.lock:
            kind, goals = standard("action_msgs/msg/GoalStatus").kind, [*self._goals.values()]
            states = [kind(goal_info=goal.info, status=goal.status) for goal in goals]
            self._status.publish(self._status.interface.kind(status_list=states))

    def start(self, goal: ServerGoalHandle) -> None:
        """Execute a goal as a task, unless the node was removed in the meantime."""
        if self._node.executor is not None:
            self._node.executor.create_task(self.execute, goal)

    async def execute(self, goal: ServerGoalHandle) -> None:
        """Execute a goal, and respond to the requests for its result."""
        try:
            result = await _result_of(self._execute_callback(goal))
            _check_type(result, self.action_type, "Result")
        except Exception:
            self._logger.error(f"the callback that executes goals failed: {format_exc()}")
            result = self.action_type.Result()
        if goal.is_active:
            self._logger.warning("the goal was neither succeeded nor canceled; aborting it")
            goal.abort()
        response = self.action_type.Impl.GetResultService.Response
        goal.response.set_result(response(status=goal.status, result=result))

    # services

    async def _accept(self, request: Any, response: Any) -> Any:
        key = bytes(request.goal_id.uuid)
        if key in self._kept_goals():
            self._logger.warning("the server rejects a goal, because another goal has the same id")
            return response
        answer = await _result_of(self._goal_callback(request.goal))
        if not isinstance(answer, GoalResponse):
            self._logger.warning("the goal is rejected: the callback returned no GoalResponse")
        # another goal may have got the id in the meantime
        if answer is GoalResponse.ACCEPT and key not in self._goals:
            response.accepted = True
            response.stamp = self._node.get_clock().now().to_msg()
            self._goals[key] = ServerGoalHandle(self, request, response.stamp)
            self.publish_status()
        return response

    async def _begin(self, request: Any, response: Any) -> None:
        """Begin a new goal; its client knows by now that it is accepted."""
        goal = self._goals.get(bytes(request.goal_id.uuid)) if response.accepted else None
        if goal is not None:
            await _result_of(self._accepted_callback(goal))

    async def _answer_result(self, request: Any, response: Any) -> Any:
        goal = self._kept_goals().get(bytes(request.goal_id.uuid))
        return response if goal is None else await goal.response

    async def _cancel(self, request: Any, response: Any) -> Any:
        key, until = bytes(request.goal_info.goal_id.uuid), _time(request.goal_info.stamp)
        # an id means this goal, a time means all goals up to it, and neither means all goals
        limit = until or (-1 if any(key) else math.inf)
        known = self._kept_goals().items()
        goals = [goal for id_, goal in known if id_ == key or _time(goal.info.stamp) <= limit]
        active = [goal for goal in goals if GoalState.CANCELING in _NEXT.get(goal.status, ())]
        for goal in active:
            answer = await _result_of(self._cancel_callback(goal))
            if answer is CancelResponse.ACCEPT:
                with suppress(RuntimeError):  # it ended in the meantime
                    goal.enter(GoalState.CANCELING)
                    response.goals_canceling.append(goal.info)
        if active and not response.goals_canceling:
            response.return_code = response.ERROR_REJECTED
        elif limit < 0 and not goals:
            response.return_code = response.ERROR_UNKNOWN_GOAL_ID
        elif limit < 0 and not active:
            response.return_code = response.ERROR_GOAL_TERMINATED
        return response

    def _kept_goals(self) -> dict[bytes, ServerGoalHandle]:
        """Return the goals by their ids, without those whose results were kept long enough."""
        oldest = monotonic() - self._timeout
        self._goals = {key: goal for key, goal in self._goals.items() if goal.ended_at >= oldest}
        return self._goals


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
        request.goal_info.goal_id = self.goal_id
        return self._client.cancel_client.call_async(request)

    def get_result_async(self) -> Future[Any]:
        """Ask for the result; the future has a response with `status` and `result`."""
        request = self._client.result_client.interface.kind.Request(goal_id=self.goal_id)
        future = self._client.result_client.call_async(request)

        def end(response: Any) -> Any:
            self._client.follow_all()
            self._client.feedback_callbacks.pop(bytes(self.goal_id.uuid), None)
            return response

        return _then(future, end)


class ActionClient:
    """A client of an action."""

    def __init__(
        self, node: Any, action_type: Any, action_name: str, *, callback_group: Any = None
    ) -> None:
        self._node = node
        self._type = action_type
        self.feedback_callbacks: dict[bytes, Callable[[Any], Any] | None] = {}
        names, impl = action_names(node.resolve_service_name(action_name)), action_type.Impl
        # in the order of rclpy, so that ids are equal
        client, cancel = node.create_client, standard("action_msgs/srv/CancelGoal")
        self._send: Client[Any, Any] = client(impl.SendGoalService, names.send_goal)
        self.cancel_client: Client[Any, Any] = client(cancel, names.cancel_goal)
        self.result_client: Client[Any, Any] = client(impl.GetResultService, names.get_result)
        self._clients = (self._send, self.cancel_client, self.result_client)
        subscribe = partial(node.create_subscription, callback_group=callback_group)
        states, qos = standard("action_msgs/msg/GoalStatusArray"), qos_profile_action_status_default
        # the states of goals are ignored; their publisher shows that there is a server
        self._subscriptions = (
            subscribe(impl.FeedbackMessage, names.feedback, self._follow, 10),
            subscribe(states, names.status, lambda _: None, qos),
        )

    def server_is_ready(self) -> bool:
        """Return whether all services and topics of a server are there."""
        return all(client.service_is_ready() for client in self._clients) and all(
            subscription.get_publisher_count() for subscription in self._subscriptions
        )

    def wait_for_server(self, timeout_sec: float | None = None) -> bool:
        """Wait until a server is there; return whether it is, for at most `timeout_sec` seconds."""
        return self._send.wait_for(self.server_is_ready, timeout_sec)

    def send_goal_async(
        self, goal: Any, feedback_callback: Callable[[Any], Any] | None = None
    ) -> Future[ClientGoalHandle]:
        """Send a goal; the future has a ClientGoalHandle when the server has answered.

        `feedback_callback` gets messages with `feedback`. Raises TypeError if the goal is of
        another type.
        """
        _check_type(goal, self._type, "Goal")
        request = self._type.Impl.SendGoalService.Request(goal=goal)
        key = uuid4().bytes
        request.goal_id.uuid = [*key]
        self.feedback_callbacks[key] = feedback_callback

        def answer(response: Any) -> Any:
            if response is None or not response.accepted:
                self.feedback_callbacks.pop(key, None)
            return response and ClientGoalHandle(self, request.goal_id, response)

        return _then(self._send.call_async(request), answer)

    def destroy(self) -> None:
        """Remove the clients and subscriptions."""
        for endpoint in (*self._clients, *self._subscriptions):
            self._node.destroy_client(endpoint)

    def follow_all(self) -> None:
        """Call back for the feedback that has arrived, which is older than a result."""
        for message in iter(self._subscriptions[0].next_message, None):
            result = self._follow(message)
            if isawaitable(result) and self._node.executor is not None:
                self._node.executor.create_task(result)

    def _follow(self, message: Any) -> Any:
        callback = self.feedback_callbacks.get(bytes(message.goal_id.uuid))
        return callback and callback(message)


def _then(future: Future[Any], work: Callable[[Any], Any]) -> Future[Any]:
    """Return the future of what `work` makes of a response, or of the `None` of a failure."""
    later: Future[Any] = Future()

    def finish(_: Future[Any]) -> None:
        error = future.exception()
        result = work(None if error else future.result())
        later.executor = future.executor
        if error is not None:
            later.set_exception(error)
        elif result is not None:
            later.set_result(result)
        later.cancel()  # if the request was

    future.add_done_callback(finish)
    return later


def _check_type(message: Any, action: Any, part: str) -> None:
    """Raise TypeError if a message is not this part of an action."""
    if not isinstance(message, getattr(action, part)):
        raise TypeError(f"{message!r} is not a {action.__name__}.{part}")


def _time(stamp: Any) -> int:
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


async def _result_of(value: Any) -> Any:
    return await value if isawaitable(value) else value
