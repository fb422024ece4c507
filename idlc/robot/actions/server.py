"""A server that accepts goals of clients, executes them, and answers with results."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from threading import RLock
from time import monotonic
from typing import Any

from idlc.robot.actions.goals import (
    BEFORE,
    CancelCode,
    CancelResponse,
    GoalResponse,
    GoalState,
    id_of,
    result_of,
)
from idlc.robot.names import action_names
from idlc.robot.nodes.executor import ReentrantCallbackGroup
from idlc.robot.nodes.interfaces import standard
from idlc.robot.nodes.tasks import Future
from idlc.robot.qos import (
    QoSProfile,
    qos_profile_action_status_default,
    qos_profile_default,
    qos_profile_services_default,
)


class ServerGoalHandle:
    """A goal that the server accepted."""

    def __init__(self, server: ActionServer, request: Any, stamp: Any) -> None:
        self._server = server
        self._lock = RLock()
        self._state = GoalState.ACCEPTED
        self.ended_at = 0.0
        self.request = request.goal
        self.goal_id = request.goal_id
        self.stamp = stamp
        #: It ends with the response to clients that ask for the result.
        self.response: Future[Any] = Future()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ServerGoalHandle) and id_of(self.goal_id) == id_of(other.goal_id)

    def __hash__(self) -> int:
        return hash(id_of(self.goal_id))

    @property
    def status(self) -> int:
        """The state, as a number of action_msgs/msg/GoalStatus."""
        return self._state

    @property
    def is_active(self) -> bool:
        """True until the goal has succeeded or aborted, or is canceled."""
        return self._state.is_active

    @property
    def is_cancel_requested(self) -> bool:
        """True if the server accepted a client's request to cancel."""
        return self._state is GoalState.CANCELING

    def execute(self, execute_callback: Callable[[ServerGoalHandle], Any] | None = None) -> None:
        """Execute the goal soon, by the callback of the server or another one."""
        if not self.is_cancel_requested:
            self.enter(GoalState.EXECUTING)
        self._server.begin(self, execute_callback)

    def publish_feedback(self, feedback: Any) -> None:
        """Send feedback to the clients; raise TypeError if it is of another type."""
        self._server.publish_feedback(self, feedback)

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
        with self._lock:
            if self._state not in BEFORE[state]:
                raise RuntimeError(f"a goal that is {self._state.name} cannot become {state.name}")
            self._state = state
            self.ended_at = monotonic()
        self._server.publish_status()


class ActionServer:
    """A server of an action.

    `execute_callback` gets a ServerGoalHandle and returns a result, `goal_callback` gets a goal and
    returns a GoalResponse, `cancel_callback` gets the handle and returns a CancelResponse. They may
    be coroutines. Results are kept for `result_timeout` seconds, for ever if it is negative.
    """

    def __init__(
        self,
        node: Any,
        action_type: Any,
        action_name: str,
        execute_callback: Callable[[ServerGoalHandle], Any],
        *,
        callback_group: Any = None,
        goal_callback: Callable[[Any], Any] | None = None,
        handle_accepted_callback: Callable[[ServerGoalHandle], Any] | None = None,
        cancel_callback: Callable[[ServerGoalHandle], Any] | None = None,
        goal_service_qos_profile: QoSProfile = qos_profile_services_default,
        result_service_qos_profile: QoSProfile = qos_profile_services_default,
        cancel_service_qos_profile: QoSProfile = qos_profile_services_default,
        feedback_pub_qos_profile: QoSProfile = qos_profile_default,
        status_pub_qos_profile: QoSProfile = qos_profile_action_status_default,
        result_timeout: float = 900,
    ) -> None:
        self.action_type = action_type
        self._node = node
        self._timeout = result_timeout
        self._goals: dict[bytes, ServerGoalHandle] = {}
        self._lock = RLock()
        self._logger = node.get_logger().get_child("action_server")
        self.register_execute_callback(execute_callback)
        self.register_goal_callback(goal_callback)
        self.register_handle_accepted_callback(handle_accepted_callback)
        self.register_cancel_callback(cancel_callback)
        names = action_names(node.resolve_service_name(action_name))
        impl = action_type.Impl
        cancel = standard("action_msgs/srv/CancelGoal").kind
        # in the order of rclpy, so that ids are equal; goals that arrive meanwhile wait
        with self._lock:
            self._services = [
                node.create_service(kind, name, answer, qos_profile=qos, callback_group=group)
                for kind, name, answer, qos, group in (
                    (
                        impl.SendGoalService,
                        names.send_goal,
                        self._accept,
                        goal_service_qos_profile,
                        callback_group,
                    ),
                    (
                        cancel,
                        names.cancel_goal,
                        self._cancel,
                        cancel_service_qos_profile,
                        callback_group,
                    ),
                    (
                        impl.GetResultService,
                        names.get_result,
                        self._answer_result,
                        result_service_qos_profile,
                        ReentrantCallbackGroup(),  # requests wait until their goals end
                    ),
                )
            ]
            self._feedback = node.create_publisher(
                impl.FeedbackMessage, names.feedback, feedback_pub_qos_profile
            )
            self._status = node.create_publisher(
                _message("GoalStatusArray"), names.status, status_pub_qos_profile
            )

    def register_execute_callback(
        self, execute_callback: Callable[[ServerGoalHandle], Any]
    ) -> None:
        """Execute goals by another callback; raise TypeError if it cannot be called."""
        if not callable(execute_callback):
            raise TypeError(
                f"the callback that executes goals is not callable: {execute_callback!r}"
            )
        self._execute_callback = execute_callback

    def register_goal_callback(self, goal_callback: Callable[[Any], Any] | None) -> None:
        """Decide on new goals by another callback; `None` accepts all."""
        self._goal_callback = goal_callback or (lambda _: GoalResponse.ACCEPT)

    def register_handle_accepted_callback(
        self, handle_accepted_callback: Callable[[ServerGoalHandle], Any] | None
    ) -> None:
        """Begin accepted goals by another callback; `None` executes them at once."""
        self._accepted_callback = handle_accepted_callback or ServerGoalHandle.execute

    def register_cancel_callback(
        self, cancel_callback: Callable[[ServerGoalHandle], Any] | None
    ) -> None:
        """Decide on requests to cancel by another callback; `None` rejects all."""
        self._cancel_callback = cancel_callback or (lambda _: CancelResponse.REJECT)

    def destroy(self) -> None:
        """Remove the services and topics; goals that are executed go on unseen."""
        for service in self._services:
            self._node.destroy_service(service)
        self._node.destroy_publisher(self._feedback)
        self._node.destroy_publisher(self._status)

    # for handles of goals

    def begin(
        self, goal: ServerGoalHandle, callback: Callable[[ServerGoalHandle], Any] | None
    ) -> None:
        """Execute a goal soon."""
        self._soon(self._execute, goal, callback or self._execute_callback)

    def publish_feedback(self, goal: ServerGoalHandle, feedback: Any) -> None:
        """Publish feedback about a goal."""
        if not isinstance(feedback, self.action_type.Feedback):
            raise TypeError(f"{feedback!r} is not a {self.action_type.__name__}.Feedback")
        self._feedback.publish(
            self.action_type.Impl.FeedbackMessage(goal_id=goal.goal_id, feedback=feedback)
        )

    def publish_status(self) -> None:
        """Publish the states of all goals."""
        with self._lock:  # so that an older state is not published after a newer one
            states = [
                _message("GoalStatus")(goal_info=self._info(goal), status=goal.status)
                for goal in [*self._goals.values()]
            ]
            self._status.publish(_message("GoalStatusArray")(status_list=states))

    # services

    async def _accept(self, request: Any, response: Any) -> Any:
        self._expire()
        key = id_of(request.goal_id)
        if key in self._goals:
            self._logger.warning("the server rejects a goal, because another goal has the same id")
            return response
        answer = await result_of(self._goal_callback(request.goal))
        if not isinstance(answer, GoalResponse):
            self._logger.warning("the goal is rejected: the callback returned no GoalResponse")
        # another goal may have got the id in the meantime
        if answer is not GoalResponse.ACCEPT or key in self._goals:
            return response
        stamp = self._node.get_clock().now().to_msg()
        goal = self._goals[key] = ServerGoalHandle(self, request, stamp)
        self.publish_status()
        response.accepted = True
        response.stamp = stamp
        # as a task, so that the client learns that the goal is accepted before it begins
        self._soon(self._begin, goal)
        return response

    def _soon(self, *work: Any) -> None:
        if self._node.executor is not None:  # otherwise the node was removed in the meantime
            self._node.executor.create_task(*work)

    async def _begin(self, goal: ServerGoalHandle) -> None:
        await result_of(self._accepted_callback(goal))

    async def _execute(
        self, goal: ServerGoalHandle, callback: Callable[[ServerGoalHandle], Any]
    ) -> None:
        result: Any = None
        try:
            result = await result_of(callback(goal))
        except Exception as error:
            self._logger.error(f"the callback that executes goals raised {error!r}")
            traceback.print_exc()
        else:
            if not isinstance(result, self.action_type.Result):
                self._logger.error(
                    f"the callback that executes goals returned {result!r}, which is no"
                    f" {self.action_type.__name__}.Result"
                )
                result = None
        if goal.is_active:
            self._logger.warning("the goal was neither succeeded nor canceled; aborting it")
            if goal.status == GoalState.ACCEPTED:
                goal.enter(GoalState.EXECUTING)
            goal.abort()
        response = self.action_type.Impl.GetResultService.Response()
        response.status = int(goal.status)
        response.result = self.action_type.Result() if result is None else result
        if not goal.response.done():
            goal.response.set_result(response)

    async def _answer_result(self, request: Any, response: Any) -> Any:
        self._expire()
        goal = self._goals.get(id_of(request.goal_id))
        return response if goal is None else await goal.response

    async def _cancel(self, request: Any, response: Any) -> Any:
        self._expire()
        goals, response.return_code = self._to_cancel(request.goal_info)
        for goal in goals:
            answer = await result_of(self._cancel_callback(goal))
            if answer is CancelResponse.ACCEPT:
                try:
                    goal.enter(GoalState.CANCELING)
                except RuntimeError:  # it ended in the meantime
                    continue
                response.goals_canceling.append(self._info(goal))
        if goals and not response.goals_canceling:
            response.return_code = CancelCode.REJECTED
        return response

    def _to_cancel(self, info: Any) -> tuple[list[ServerGoalHandle], CancelCode]:
        """Return the goals that a request means: one, all up to a time, or all."""
        key, until = id_of(info.goal_id), _time(info.stamp)
        active = [
            goal for goal in [*self._goals.values()] if goal.status in BEFORE[GoalState.CANCELING]
        ]
        if any(key) and not until:
            goal = self._goals.get(key)
            if goal is None:
                return [], CancelCode.UNKNOWN_GOAL_ID
            return ([goal], CancelCode.NONE) if goal in active else ([], CancelCode.GOAL_TERMINATED)
        chosen = [
            goal
            for goal in active
            if not until or _time(goal.stamp) <= until or id_of(goal.goal_id) == key
        ]
        return chosen, CancelCode.NONE

    def _info(self, goal: ServerGoalHandle) -> Any:
        return _message("GoalInfo")(goal_id=goal.goal_id, stamp=goal.stamp)

    def _expire(self) -> None:
        """Forget goals whose results were kept long enough."""
        if self._timeout >= 0:
            now = monotonic()
            for key, goal in [*self._goals.items()]:
                if not goal.is_active and now - goal.ended_at > self._timeout:
                    del self._goals[key]


def _time(stamp: Any) -> int:
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


def _message(name: str) -> Any:
    return standard(f"action_msgs/msg/{name}").kind
