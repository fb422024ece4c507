"""A server that accepts goals of clients, executes them, and answers with results."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from inspect import isawaitable
from threading import RLock
from time import monotonic
from traceback import format_exc
from typing import Any, TypeAlias

from idlc.robot.actions.goals import CancelResponse, GoalResponse, GoalState
from idlc.robot.names import action_names
from idlc.robot.nodes.executor import Future, ReentrantCallbackGroup
from idlc.robot.nodes.interfaces import standard
from idlc.robot.qos import qos_profile_action_status_default

#: The states from which a goal can enter a state.
BEFORE: dict[GoalState, tuple[GoalState, ...]] = {
    GoalState.EXECUTING: (GoalState.ACCEPTED,),
    GoalState.CANCELING: (GoalState.ACCEPTED, GoalState.EXECUTING),
    GoalState.SUCCEEDED: (GoalState.EXECUTING, GoalState.CANCELING),
    GoalState.CANCELED: (GoalState.CANCELING,),
    GoalState.ABORTED: (GoalState.EXECUTING, GoalState.CANCELING),
}


class ServerGoalHandle:
    """A goal that the server accepted; `status` is a number of action_msgs/msg/GoalStatus."""

    def __init__(self, server: ActionServer, request: Any, stamp: Any) -> None:
        self._server = server
        self.request = request.goal
        self.goal_id = request.goal_id
        self.info = _message("GoalInfo")(goal_id=request.goal_id, stamp=stamp)
        self.status = GoalState.ACCEPTED
        self.ended_at = math.inf
        #: It ends with the response to clients that ask for the result.
        self.response: Future[Any] = Future()

    @property
    def is_active(self) -> bool:
        """True until the goal has succeeded or aborted, or is canceled."""
        return self.status <= GoalState.CANCELING

    @property
    def is_cancel_requested(self) -> bool:
        """True if the server accepted a client's request to cancel."""
        return self.status is GoalState.CANCELING

    def execute(self, execute_callback: GoalCallback | None = None) -> None:
        """Execute the goal soon, by the callback of the server or another one."""
        if not self.is_cancel_requested:
            self.enter(GoalState.EXECUTING)
        self._server.start(self._server.execute, self, execute_callback)

    def publish_feedback(self, feedback: Any) -> None:
        """Send feedback to the clients; raise TypeError if it is of another type."""
        publisher, action = self._server.feedback_publisher, self._server.action_type
        if not isinstance(feedback, action.Feedback):
            raise TypeError(f"{feedback!r} is not a {action.__name__}.Feedback")
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
            if self.status not in BEFORE[state]:
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
        names = action_names(node.resolve_service_name(action_name))
        impl = action_type.Impl
        serve = partial(node.create_service, callback_group=callback_group)
        # requests for results wait until goals end
        serve_result = partial(node.create_service, callback_group=ReentrantCallbackGroup())
        publish = node.create_publisher
        status_type = _message("GoalStatusArray")
        # in the order of rclpy, so that ids are equal; goals that arrive meanwhile wait
        with self.lock:
            self._services = (
                serve(impl.SendGoalService, names.send_goal, self._accept),
                serve(standard("action_msgs/srv/CancelGoal").kind, names.cancel_goal, self._cancel),
                serve_result(impl.GetResultService, names.get_result, self._answer_result),
            )
            self.feedback_publisher = publish(impl.FeedbackMessage, names.feedback, 10)
            self._status = publish(status_type, names.status, qos_profile_action_status_default)

    def destroy(self) -> None:
        """Remove the services and topics; goals that are executed go on unseen."""
        for endpoint in (*self._services, self.feedback_publisher, self._status):
            self._node.destroy_service(endpoint)

    # for handles of goals

    def publish_status(self) -> None:
        """Publish the states of all goals."""
        with self.lock:
            kind, goals = _message("GoalStatus"), [*self._goals.values()]
            states = [kind(goal_info=goal.info, status=goal.status) for goal in goals]
            self._status.publish(self._status.interface.kind(status_list=states))

    def start(self, callback: Callable[..., Any], *arguments: Any) -> None:
        """Call a function or coroutine as a task, unless the node was removed in the meantime."""
        if self._node.executor is not None:
            self._node.executor.create_task(callback, *arguments)

    async def execute(self, goal: ServerGoalHandle, callback: GoalCallback | None) -> None:
        """Execute a goal, and respond to the requests for its result."""
        try:
            result = await _result_of((callback or self._execute_callback)(goal))
            if not isinstance(result, self.action_type.Result):
                raise TypeError(f"{result!r} is not a {self.action_type.__name__}.Result")
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
        self._expire()
        key = bytes(request.goal_id.uuid)
        if key in self._goals:
            self._logger.warning("the server rejects a goal, because another goal has the same id")
            return response
        answer = await _result_of(self._goal_callback(request.goal))
        if not isinstance(answer, GoalResponse):
            self._logger.warning("the goal is rejected: the callback returned no GoalResponse")
        # another goal may have got the id in the meantime
        if answer is GoalResponse.ACCEPT and key not in self._goals:
            response.accepted = True
            response.stamp = self._node.get_clock().now().to_msg()
            goal = self._goals[key] = ServerGoalHandle(self, request, response.stamp)
            self.publish_status()
            # as a task, so that the client learns that the goal is accepted before it begins
            self.start(self._accepted_callback, goal)
        return response

    async def _answer_result(self, request: Any, response: Any) -> Any:
        self._expire()
        goal = self._goals.get(bytes(request.goal_id.uuid))
        return response if goal is None else await goal.response

    async def _cancel(self, request: Any, response: Any) -> Any:
        self._expire()
        key, until = bytes(request.goal_info.goal_id.uuid), _time(request.goal_info.stamp)
        # an id means this goal, a time means all goals up to it, and neither means all goals
        limit = until or (-1 if any(key) else math.inf)
        known = self._goals.items()
        goals = [goal for id_, goal in known if id_ == key or _time(goal.info.stamp) <= limit]
        active = [goal for goal in goals if goal.status in BEFORE[GoalState.CANCELING]]
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

    def _expire(self) -> None:
        """Forget goals whose results were kept long enough."""
        oldest = monotonic() - self._timeout
        self._goals = {key: goal for key, goal in self._goals.items() if goal.ended_at >= oldest}


def _time(stamp: Any) -> int:
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


def _message(name: str) -> Any:
    return standard(f"action_msgs/msg/{name}").kind


async def _result_of(value: Any) -> Any:
    return await value if isawaitable(value) else value
