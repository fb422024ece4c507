"""Events of publishers and subscriptions: deadlines, other ends that come and go, lost messages."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from typing import Any, NamedTuple

from idlc.robot.keys import Attachment, Entity, EntityKind
from idlc.robot.nodes.clock import Clock, ClockType, Timer
from idlc.robot.nodes.executor import call
from idlc.robot.qos import FOLLOWS, LivelinessPolicy, QoSPolicyKind, incompatible_policies

#: The publishers of which a subscription knows the last message.
_MOST_PUBLISHERS = 1000


class CountInfo(NamedTuple):
    """The argument of a callback: missed deadlines or lost messages."""

    total_count: int
    total_count_change: int


class _Policy(int):
    """A QoSPolicyKind that is printed as in rclpy."""

    def __str__(self) -> str:
        return f"rmw_qos_policy_kind_t.RMW_QOS_POLICY_{QoSPolicyKind(self).name}"

    def __format__(self, format_spec: str) -> str:
        return format(str(self), format_spec)


class IncompatibleInfo(NamedTuple):
    """The argument of a callback: ends that are not connected, as their QoS does not fit."""

    total_count: int
    total_count_change: int
    last_policy_kind: int


class MatchedInfo(NamedTuple):
    """The argument of a callback: ends that are connected."""

    total_count: int
    total_count_change: int
    current_count: int
    current_count_change: int


class LivelinessInfo(NamedTuple):
    """The argument of a callback: publishers that are alive."""

    alive_count: int
    not_alive_count: int
    alive_count_change: int
    not_alive_count_change: int


# rclpy's names
QoSMessageLostInfo = QoSOfferedDeadlineMissedInfo = QoSRequestedDeadlineMissedInfo = CountInfo
QoSOfferedIncompatibleQoSInfo = QoSRequestedIncompatibleQoSInfo = IncompatibleInfo
QoSPublisherMatchedInfo = QoSSubscriptionMatchedInfo = MatchedInfo
QoSLivelinessChangedInfo = LivelinessInfo


class UnsupportedEventTypeError(Exception):
    """An event was requested that idlc never reports."""


class EventCallbacks(NamedTuple):
    """Callbacks for events, which get a count of what happened.

    `deadline`: no message came in the period of the profile. `incompatible_qos`, `matched`: another
    end came, or went. `liveliness`: a publisher came or went. `message_lost`: numbers of messages
    are missing.
    """

    deadline: Callable[[CountInfo], Any] | None = None
    incompatible_qos: Callable[[IncompatibleInfo], Any] | None = None
    liveliness: Callable[[LivelinessInfo], Any] | None = None
    message_lost: Callable[[CountInfo], Any] | None = None
    matched: Callable[[MatchedInfo], Any] | None = None
    use_default_callbacks: bool = True


PublisherEventCallbacks = SubscriptionEventCallbacks = EventCallbacks


class Events:
    """Calls the callbacks of an endpoint, which is a Publisher or a Subscription."""

    def __init__(self, endpoint: Any, callbacks: EventCallbacks) -> None:
        self._endpoint = endpoint
        self._callbacks = callbacks
        self._is_publisher = endpoint.kind is EntityKind.PUBLISHER
        self._timers: list[Timer] = []
        self._graph = None
        profile, liveliness = endpoint.qos_profile, callbacks.liveliness
        if liveliness and profile.liveliness is LivelinessPolicy.MANUAL_BY_TOPIC:
            raise UnsupportedEventTypeError(
                "idlc does not report `liveliness` other than automatic"
            )
        #: The timer of the deadline; each message begins a period.
        self.deadline: Timer | None = None
        if callbacks.deadline is not None and profile.deadline < FOLLOWS:
            group, clock = endpoint.callback_group, Clock(clock_type=ClockType.STEADY_TIME)
            self._misses = count(1)
            self.deadline = endpoint.node.create_timer(
                profile.deadline / 1e9, self._miss, group, clock
            )
            self.deadline.cancel()
            self._timers.append(self.deadline)
        self._numbers: dict[bytes, int] = {}
        self._lost = self._told = 0
        self._loss = self._condition(self._tell_lost) if callbacks.message_lost else None
        if callbacks.matched or callbacks.incompatible_qos or liveliness:
            self._matched: set[Entity] = set()
            self._unfit: set[Entity] = set()
            self._total = self._unfit_total = 0
            self._graph = endpoint.node.graph
            self._look = self._condition(self._compare)
            self._graph.watchers.add(self._look)
            self._look.trigger()

    def _condition(self, callback: Callable[[], Any]) -> Any:
        condition = self._endpoint.node.create_guard_condition(
            callback, self._endpoint.callback_group
        )
        self._timers.append(condition)
        return condition

    def destroy(self) -> None:
        """Call back no more."""
        if self._graph is not None:
            self._graph.watchers.discard(self._look)
        while self._timers:
            self._endpoint.node.destroy_timer(self._timers.pop())

    def note(self, attachment: Attachment) -> None:
        """Count the messages that are missing before one that arrived."""
        if self._loss is None:
            return
        number, source = attachment.sequence, attachment.gid
        before = self._numbers.get(source, number - 1)
        if source not in self._numbers and len(self._numbers) >= _MOST_PUBLISHERS:
            self._numbers.clear()
        self._numbers[source] = max(before, number)
        if number > before + 1:
            self._lost += number - before - 1
            self._loss.trigger()

    def _miss(self) -> Any:
        callback = self._callbacks.deadline
        return callback and callback(CountInfo(next(self._misses), 1))

    def _tell_lost(self) -> Any:
        change, self._told = self._lost - self._told, self._lost
        callback = self._callbacks.message_lost
        return callback and callback(CountInfo(self._told, change))

    async def _compare(self) -> None:
        """Compare the other ends in the graph with those that were there before."""
        own = self._endpoint.entity
        kind = EntityKind.SUBSCRIPTION if self._is_publisher else EntityKind.PUBLISHER
        matched, unfit, last = set(), set(), ""
        for other in self._endpoint.node.graph.entities(kind, own.name):
            if (other.type, other.hash) != (own.type, own.hash):
                continue
            ends = (own, other) if self._is_publisher else (other, own)
            policies = incompatible_policies(ends[0].qos, ends[1].qos)
            if policies and not self._endpoint.node.transport.connects_all:
                unfit.add(other)
                last = policies[-1] if other not in self._unfit else last
            else:
                matched.add(other)
        new, change = len(matched - self._matched), len(matched) - len(self._matched)
        new_unfit = len(unfit - self._unfit)
        is_changed = matched != self._matched
        self._matched, self._unfit = matched, unfit
        self._total += new
        self._unfit_total += new_unfit
        callbacks = self._callbacks
        if is_changed and callbacks.matched:
            await call(callbacks.matched, MatchedInfo(self._total, new, len(matched), change))
        if is_changed and callbacks.liveliness and not self._is_publisher:
            await call(callbacks.liveliness, LivelinessInfo(len(matched), 0, change, 0))
        if new_unfit and callbacks.incompatible_qos:
            # DDS has one policy of both
            policy = QoSPolicyKind[last.upper().removesuffix("_LEASE_DURATION")]
            info = IncompatibleInfo(self._unfit_total, new_unfit, _Policy(policy))
            await call(callbacks.incompatible_qos, info)
