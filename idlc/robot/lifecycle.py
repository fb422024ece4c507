"""Lifecycle nodes in the words of rclpy: their states, transitions and managed entities."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from functools import partialmethod, wraps
from traceback import format_exc
from typing import Any, NamedTuple

from idlc.robot.nodes.endpoints import Publisher
from idlc.robot.nodes.executor import CallbackGroup
from idlc.robot.nodes.interfaces import M, standard
from idlc.robot.nodes.node import Node


class LifecycleState(NamedTuple):
    """A state; the numbers are those of lifecycle_msgs/msg/State."""

    label: str
    state_id: int

    def to_msg(self) -> Any:
        """Return it as lifecycle_msgs/msg/State."""
        return _message("State", id=self.state_id, label=self.label)


class _Transition(NamedTuple):
    """A transition; the numbers are those of lifecycle_msgs/msg/Transition."""

    number: int
    label: str
    start: LifecycleState
    goal: LifecycleState

    def to_msg(self) -> Any:
        """Return it as lifecycle_msgs/msg/TransitionDescription."""
        transition = _message("Transition", id=self.number, label=self.label)
        states = {"start_state": self.start.to_msg(), "goal_state": self.goal.to_msg()}
        return _message("TransitionDescription", transition=transition, **states)


_PRIMARY = "unknown unconfigured inactive active finalized"
_PASSING = "configuring cleaningup shuttingdown activating deactivating errorprocessing"
_STATES = {
    label: LifecycleState(label, number)
    for first, labels in ((0, _PRIMARY), (10, _PASSING))
    for number, label in enumerate(labels.split(), first)
}
#: The transitions in ROS 2's order: the number, the label, and the states before and after.
_TABLE = """
1 configure unconfigured configuring
10 transition_success configuring inactive
11 transition_failure configuring unconfigured
12 transition_error configuring errorprocessing
2 cleanup inactive cleaningup
20 transition_success cleaningup unconfigured
21 transition_failure cleaningup inactive
22 transition_error cleaningup errorprocessing
3 activate inactive activating
30 transition_success activating active
31 transition_failure activating inactive
32 transition_error activating errorprocessing
4 deactivate active deactivating
40 transition_success deactivating inactive
41 transition_failure deactivating active
42 transition_error deactivating errorprocessing
5 shutdown unconfigured shuttingdown
6 shutdown inactive shuttingdown
7 shutdown active shuttingdown
50 transition_success shuttingdown finalized
51 transition_failure shuttingdown finalized
52 transition_error shuttingdown errorprocessing
60 transition_success errorprocessing unconfigured
61 transition_failure errorprocessing finalized
62 transition_error errorprocessing finalized
"""
_TRANSITIONS = [
    _Transition(int(number), label, _STATES[start], _STATES[goal])
    for number, label, start, goal in map(str.split, _TABLE.strip().splitlines())
]


class TransitionCallbackReturn(Enum):
    """The outcome of a callback, which decides about the next state."""

    SUCCESS = 97
    FAILURE = 98
    ERROR = 99

    def to_label(self) -> str:
        """Return the label of the transition that follows."""
        return f"transition_{self.name.lower()}"


class ManagedEntity:
    """Something that follows the states of its node; callbacks get the state before."""

    def _succeed(self, state: LifecycleState) -> TransitionCallbackReturn:  # noqa: ARG002
        return TransitionCallbackReturn.SUCCESS

    on_configure = on_cleanup = on_shutdown = on_activate = on_deactivate = on_error = _succeed


class SimpleManagedEntity(ManagedEntity):
    """An entity that is activated and deactivated with its node."""

    _enabled = False

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:  # noqa: ARG002
        """Enable the entity."""
        self._enabled = True
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:  # noqa: ARG002
        """Disable the entity."""
        self._enabled = False
        return TransitionCallbackReturn.SUCCESS

    @property
    def is_activated(self) -> bool:
        """True while the entity is enabled."""
        return self._enabled

    @staticmethod
    def when_enabled(
        wrapped: Any = None, *, when_not_enabled: Callable[[], Any] | None = None
    ) -> Any:
        """Return a method that does nothing, or calls `when_not_enabled`, while it is disabled."""

        def decorate(method: Callable[..., Any]) -> Any:
            @wraps(method)
            def call_when_enabled(self: SimpleManagedEntity, *args: Any, **kwargs: Any) -> None:
                if self.is_activated:
                    method(self, *args, **kwargs)
                elif when_not_enabled is not None:
                    when_not_enabled()

            return call_when_enabled

        return decorate if wrapped is None else decorate(wrapped)


class LifecyclePublisher(SimpleManagedEntity, Publisher[M]):
    """A publisher that sends messages only while its node is active."""

    @SimpleManagedEntity.when_enabled
    def publish(self, msg: M) -> None:
        """Send a message; see `Publisher.publish`."""
        super().publish(msg)


class _StateMachine:
    """The state of a node, and what changes it and shows it."""

    def __init__(self, node: Any, is_shown: bool, group: CallbackGroup | None) -> None:
        self._node = node
        self._state = _STATES["unconfigured"]
        self._events = None
        if not is_shown:
            return
        # in the order of rclpy, so that ids are equal
        event = standard("lifecycle_msgs/msg/TransitionEvent")
        self._events = node.create_publisher(event, "~/transition_event", 10)
        for name, kind, answer in (
            ("change_state", "ChangeState", self._answer_change),
            ("get_state", "GetState", self._answer_state),
            ("get_available_states", "GetAvailableStates", self._answer_states),
            ("get_available_transitions", "GetAvailableTransitions", self._answer_available),
            ("get_transition_graph", "GetAvailableTransitions", self._answer_graph),
        ):
            service = standard(f"lifecycle_msgs/srv/{kind}")
            node.create_service(service, f"~/{name}", answer, callback_group=group)

    def trigger(self, word: str) -> TransitionCallbackReturn:
        """Begin a transition, by its label or number, and run the callbacks; return the outcome.

        Raises RuntimeError if no such transition begins in this state.
        """
        for transition in self._available():
            if word in (transition.label, str(transition.number)):
                break
        else:
            raise RuntimeError(f"no transition `{word}` begins in the state `{self._state.label}`")
        start = self._state
        self._enter(transition)
        outcome = self._call_back(f"on_{transition.label}", start)
        if outcome is TransitionCallbackReturn.ERROR:
            self._call_back("on_error", start)
        return outcome

    def _available(self) -> list[_Transition]:
        return [each for each in _TRANSITIONS if each.start == self._state]

    def _call_back(self, name: str, start: LifecycleState) -> TransitionCallbackReturn:
        outcome = TransitionCallbackReturn.ERROR
        try:
            result = getattr(self._node, name)(start)
            if not isinstance(result, TransitionCallbackReturn):
                raise TypeError(f"{name} returned {result!r}, not a TransitionCallbackReturn")
            outcome = result
        except Exception:
            self._node.get_logger().error(f"{name} failed: {format_exc()}")
        self._enter(next(each for each in self._available() if each.label == outcome.to_label()))
        return outcome

    def _enter(self, transition: _Transition) -> None:
        self._state = transition.goal
        if self._events is not None:
            # rcl leaves the time and the transition empty
            start, goal = transition.start.to_msg(), transition.goal.to_msg()
            event = _message("TransitionEvent", start_state=start, goal_state=goal)
            self._events.publish(event)

    # services

    def _answer_change(self, request: Any, response: Any) -> Any:
        word = request.transition.label or str(request.transition.id)
        try:
            response.success = self.trigger(word) is TransitionCallbackReturn.SUCCESS
        except RuntimeError as error:
            self._node.get_logger().warning(f"a request to change the state failed: {error}")
        return response

    def _answer_state(self, _: Any, response: Any) -> Any:
        response.current_state = self._state.to_msg()
        return response

    def _answer_states(self, _: Any, response: Any) -> Any:
        response.available_states = [state.to_msg() for state in _STATES.values()]
        return response

    def _answer_available(self, _: Any, response: Any) -> Any:
        response.available_transitions = [each.to_msg() for each in self._available()]
        return response

    def _answer_graph(self, _: Any, response: Any) -> Any:
        response.available_transitions = [each.to_msg() for each in _TRANSITIONS]
        return response


class LifecycleNodeMixin(ManagedEntity):
    """Adds states to a Node; its `on_` methods call those of the managed entities.

    An `on_` method gets the state before, and returns a TransitionCallbackReturn. If it raises an
    exception, that is an error, and `on_error` decides whether the node can be used again.
    """

    def __init__(
        self: Any,
        *,
        enable_communication_interface: bool = True,
        callback_group: CallbackGroup | None = None,
    ) -> None:
        self._managed_entities: list[ManagedEntity] = []
        self._state_machine = _StateMachine(self, enable_communication_interface, callback_group)

    def add_managed_entity(self: Any, entity: ManagedEntity) -> None:
        """Let an entity follow the states of the node."""
        if not isinstance(entity, ManagedEntity):
            raise TypeError(f"{entity!r} is not a ManagedEntity")
        if entity not in self._managed_entities:
            self._managed_entities.append(entity)

    def create_lifecycle_publisher(self: Any, *args: Any, **kwargs: Any) -> Any:
        """Return a LifecyclePublisher; see `Node.create_publisher`."""
        publisher = self.create_publisher(*args, **kwargs, publisher_class=LifecyclePublisher)
        self.add_managed_entity(publisher)
        return publisher

    def destroy_lifecycle_publisher(self: Any, publisher: LifecyclePublisher[Any]) -> bool:
        """Withdraw a publisher; return whether it was of this node."""
        if publisher in self._managed_entities:
            self._managed_entities.remove(publisher)
        return bool(self.destroy_publisher(publisher))

    def _manage(self: Any, name: str, state: LifecycleState) -> TransitionCallbackReturn:
        """Call a method of all entities, up to the first that fails."""
        for entity in [*self._managed_entities]:
            result = getattr(entity, name)(state)
            if not isinstance(result, TransitionCallbackReturn):
                raise TypeError(f"{name} of {entity!r} returned no TransitionCallbackReturn")
            if result is not TransitionCallbackReturn.SUCCESS:
                return result
        return TransitionCallbackReturn.SUCCESS

    on_configure = partialmethod(_manage, "on_configure")
    on_cleanup = partialmethod(_manage, "on_cleanup")
    on_shutdown = partialmethod(_manage, "on_shutdown")
    on_activate = partialmethod(_manage, "on_activate")
    on_deactivate = partialmethod(_manage, "on_deactivate")
    on_error = partialmethod(_manage, "on_error")

    def _trigger(self: Any, label: str) -> TransitionCallbackReturn:
        return self._state_machine.trigger(label)  # type: ignore[no-any-return]

    trigger_configure = partialmethod(_trigger, "configure")
    trigger_cleanup = partialmethod(_trigger, "cleanup")
    trigger_shutdown = partialmethod(_trigger, "shutdown")
    trigger_activate = partialmethod(_trigger, "activate")
    trigger_deactivate = partialmethod(_trigger, "deactivate")


class LifecycleNode(LifecycleNodeMixin, Node):
    """A node with states; see LifecycleNodeMixin and Node."""

    def __init__(
        self, node_name: str, *, enable_communication_interface: bool = True, **kwargs: Any
    ) -> None:
        Node.__init__(self, node_name, **kwargs)
        LifecycleNodeMixin.__init__(
            self, enable_communication_interface=enable_communication_interface
        )


def _message(name: str, /, **values: Any) -> Any:
    return standard(f"lifecycle_msgs/msg/{name}").kind(**values)
