"""Publishers and subscriptions, with their events."""

from __future__ import annotations

import inspect
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from threading import Lock
from typing import Any, Generic, NamedTuple, TypeVar

from idlc.diagnostics.text import one_line
from idlc.robot.errors import RobotError
from idlc.robot.keys import Attachment, Entity, Kind, pack_attachment, parse_attachment
from idlc.robot.nodes.clock import Clock, ClockType, Timer
from idlc.robot.nodes.executor import CallbackGroup, Ready
from idlc.robot.nodes.interfaces import Interface, MessageLike
from idlc.robot.qos import INFINITE, HistoryPolicy, QoSProfile
from idlc.robot.transport import Sample
from idlc.runtime.names import DecodeError
from idlc.runtime.typeinfo import is_copy

M = TypeVar("M", bound=MessageLike)
T = TypeVar("T")

#: The bytes that wait in one queue; the newest message is kept, however large it is.
MOST_QUEUED = 256 * 2**20
#: The bytes that a message takes besides its payload.
_OVERHEAD = 512
_MOST_EVENTS = 1000


class Endpoint:
    """The base class of publishers, subscriptions, services and clients.

    `node` is a Node, the class of which uses this one.
    """

    def __init__(
        self, node: Any, kind: Kind, name: str, interface: Interface, qos: QoSProfile
    ) -> None:
        self.node = node
        self.interface = interface
        self.qos_profile = qos
        #: How the graph shows the endpoint.
        self.entity: Entity = node.entity(kind, name, interface, qos)
        self._closeables: list[Any] = []

    def announce(self) -> None:
        """Show the endpoint to others, after what it needs has been declared."""
        self._closeables.append(self.node.transport.announce(self.entity.token))

    def destroy(self) -> None:
        """Withdraw the endpoint; may be called twice."""
        while self._closeables:
            self._closeables.pop().close()

    def decode(self, kind: Any, payload: bytes) -> Any:
        """Return a message; warn and return `None` if it is not one."""
        try:
            return kind.deserialize(payload)
        except DecodeError as error:
            self.warn(
                f"`{self.entity.name}`: idlc ignores data that is not {self.interface.name}", error
            )
            return None

    def warn(self, problem: str, error: Exception) -> None:
        """Log a problem with what others send, once in a while."""
        text = f"{problem}: {one_line(str(error))}"
        self.node.get_logger().warning(text, throttle_duration_sec=10.0)


def is_instance(value: Any, kind: Any) -> bool:
    """Return whether a message is of this class or of a copy of it."""
    return isinstance(value, kind) or is_copy(kind, type(value))


class Bounded(Generic[T]):
    """A queue that drops the oldest items beyond a number, and beyond MOST_QUEUED bytes."""

    def __init__(self, qos: QoSProfile) -> None:
        keeps_all = qos.history is HistoryPolicy.KEEP_ALL
        self._depth = None if keeps_all else qos.depth
        self._items: deque[tuple[int, T]] = deque()
        self._size = 0
        self._lock = Lock()

    def __len__(self) -> int:
        return len(self._items)

    def append(self, item: T, size: int) -> list[T]:
        """Append an item of `size` bytes; return those that were dropped for it."""
        dropped = []
        size += _OVERHEAD
        with self._lock:
            items = self._items
            while items and (len(items) == self._depth or self._size + size > MOST_QUEUED):
                oldest, other = items.popleft()
                self._size -= oldest
                dropped.append(other)
            items.append((size, item))
            self._size += size
        return dropped

    def pop(self) -> T | None:
        """Return the oldest item, `None` if there is none."""
        with self._lock:
            if not self._items:
                return None
            size, item = self._items.popleft()
            self._size -= size
            return item


class DeadlineInfo(NamedTuple):
    """The argument of a deadline's callback."""

    total_count: int
    total_count_change: int


class MatchedInfo(NamedTuple):
    """The argument of the callback that gets told of other ends."""

    total_count: int
    total_count_change: int
    current_count: int
    current_count_change: int


class PublisherEventCallbacks(NamedTuple):
    """Callbacks for events of a publisher."""

    deadline: Callable[[DeadlineInfo], Any] | None = None
    matched: Callable[[MatchedInfo], Any] | None = None


class SubscriptionEventCallbacks(NamedTuple):
    """Callbacks for events of a subscription."""

    deadline: Callable[[DeadlineInfo], Any] | None = None
    matched: Callable[[MatchedInfo], Any] | None = None


class Deadline(Timer):
    """Calls back if no message came in the period of a profile; begins at the first message."""

    def __init__(
        self, period: int, callback: Callable[[DeadlineInfo], Any], group: CallbackGroup | None
    ) -> None:
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        super().__init__(self._miss, group, period, clock, autostart=False)
        self._inform = callback
        self._count = 0

    def _miss(self) -> Any:
        self._count += 1
        return self._inform(DeadlineInfo(self._count, 1))


class Matched(Ready):
    """Calls back when other ends of a topic appear or go."""

    def __init__(
        self,
        endpoint: Endpoint,
        callback: Callable[[MatchedInfo], Any],
        group: CallbackGroup | None,
    ) -> None:
        super().__init__(group)
        own = endpoint.entity
        self._other = Kind.SUBSCRIPTION if own.kind is Kind.PUBLISHER else Kind.PUBLISHER
        self._own = own
        self._callback = callback
        self._changes: deque[int] = deque(maxlen=_MOST_EVENTS)
        self._total = self._current = 0
        graph = endpoint.node.session.graph
        self._node = endpoint.node
        self._end = graph.listen(self._change)
        for entity in graph.entities(self._other, name=own.name):
            self._change(entity, True)

    def close(self) -> None:
        """Stop listening."""
        self._end()
        self._node.waitables.remove(self)

    def _change(self, entity: Entity, appears: bool) -> None:
        if entity.kind is self._other and entity.key == self._own.key:
            self._changes.append(1 if appears else -1)
            self.wake()

    def take(self) -> Callable[[], Any] | None:
        """Return the callback with the next change."""
        if not self._changes:
            return None
        change = self._changes.popleft()
        self._total += change > 0
        self._current += change
        if self._changes:
            self.wake()
        info = MatchedInfo(self._total, int(change > 0), self._current, change)
        return partial(self._callback, info)


class _Topic(Endpoint, Generic[M]):
    """The base class of publishers and subscriptions."""

    def __init__(
        self,
        node: Any,
        kind: Kind,
        topic: str,
        interface: Interface,
        qos: QoSProfile,
        group: CallbackGroup | None,
        events: PublisherEventCallbacks | SubscriptionEventCallbacks | None,
    ) -> None:
        super().__init__(node, kind, topic, interface, qos)
        self.deadline: Deadline | None = None
        if events is not None and events.deadline is not None and qos.deadline < INFINITE - 1:
            self.deadline = Deadline(qos.deadline, events.deadline, group)
            node.add(self.deadline, node.timers)
        if events is not None and events.matched is not None:
            matched = Matched(self, events.matched, group)
            node.add(matched, node.waitables)
            self._closeables.append(matched)

    @property
    def topic_name(self) -> str:
        """The absolute name of the topic."""
        return self.entity.name

    topic = topic_name

    @property
    def msg_type(self) -> type[M]:
        """The class of the messages."""
        kind: type[M] = self.interface.kind
        return kind

    def destroy(self) -> None:
        """Withdraw the endpoint; may be called twice."""
        super().destroy()
        if self.deadline is not None:
            self.node.destroy_timer(self.deadline)


class Publisher(_Topic[M]):
    """Sends messages of a topic, from any thread."""

    def __init__(
        self,
        node: Any,
        topic: str,
        interface: Interface,
        qos: QoSProfile,
        *,
        group: CallbackGroup | None = None,
        events: PublisherEventCallbacks | None = None,
    ) -> None:
        super().__init__(node, Kind.PUBLISHER, topic, interface, qos, group, events)
        self._gid = self.entity.gid
        self._kind: Any = None
        self._count = 0
        self._lock = Lock()
        self._sender = node.transport.publisher(self.entity.key, qos)
        self._put = self._sender.put
        self._closeables.append(self._sender)
        self.announce()

    def publish(self, msg: M | bytes) -> None:
        """Send a message, or one that is encoded already.

        Raises TypeError for another class, ValidationError for a value that its field cannot hold,
        and RobotError after the publisher was destroyed.
        """
        message: Any = msg  # type checkers do not see that `bytes` go the other way
        payload = message.serialize() if msg.__class__ is self._kind else self._encode(msg)
        try:
            with self._lock:
                self._count = count = self._count + 1
                self._put(payload, pack_attachment(count, time.time_ns(), self._gid))
        except Exception as error:
            raise RobotError(f"`{self.entity.name}`: {one_line(str(error))}") from None
        if self.deadline is not None:
            self.deadline.begin_period()

    def _encode(self, msg: Any) -> bytes:
        if isinstance(msg, (bytes, bytearray, memoryview)):
            return bytes(msg)
        self._kind = self.interface.kind
        if is_instance(msg, self._kind):
            payload: bytes = msg.serialize()
            return payload
        expected = f"{self.interface.name}, not {type(msg).__name__}"
        raise TypeError(f"messages of `{self.entity.name}` are {expected}")

    def get_subscription_count(self) -> int:
        """Return the number of subscriptions that receive the messages."""
        return int(self.node.count_matching(Kind.SUBSCRIPTION, self.entity))

    def assert_liveliness(self) -> None:
        """Do nothing: a session that is there is alive."""


def _takes_info(callback: Callable[..., Any]) -> bool:
    """Return whether a callback takes a message and its info, not only the message."""
    signature = inspect.signature(callback)
    try:
        signature.bind(object())
    except TypeError:
        signature.bind(object(), object())
        return True
    return False


class Subscription(_Topic[M], Ready):
    """Receives messages of a topic: a queue that drops the oldest beyond the depth.

    `ignored` counts the messages without an attachment and those that could not be decoded.
    """

    def __init__(
        self,
        node: Any,
        topic: str,
        interface: Interface,
        callback: Callable[..., Any],
        qos: QoSProfile,
        *,
        group: CallbackGroup | None = None,
        events: SubscriptionEventCallbacks | None = None,
        raw: bool = False,
    ) -> None:
        Ready.__init__(self, group)
        super().__init__(node, Kind.SUBSCRIPTION, topic, interface, qos, group, events)
        self.raw = raw
        self.ignored = 0
        self.callback = callback
        self._takes_info = _takes_info(callback)
        self._queue: Bounded[tuple[bytes, Attachment, int]] = Bounded(qos)
        subscriber = node.transport.subscriber(self.entity.key, qos, self._receive)
        self._closeables.append(subscriber)
        self.announce()

    def _receive(self, sample: Sample) -> None:
        attachment = parse_attachment(sample.attachment)
        if attachment is None:
            self.ignored += 1
            return
        received = time.time_ns() if self._takes_info else 0
        self._queue.append((sample.payload, attachment, received), len(sample.payload))
        if self.deadline is not None:
            self.deadline.begin_period()
        self.wake()

    def next_message(self) -> tuple[Any, Attachment, int] | None:
        """Return the oldest message in the queue that can be decoded."""
        while (item := self._queue.pop()) is not None:
            payload, attachment, received = item
            message = payload if self.raw else self.decode(self.interface.kind, payload)
            if message is not None:
                return message, attachment, received
            self.ignored += 1
        return None

    def take(self) -> Callable[[], Any] | None:
        """Return the callback with the next message."""
        item = self.next_message()
        if self._queue:
            self.wake()
        if item is None:
            return None
        message, attachment, received = item
        if not self._takes_info:
            return partial(self.callback, message)
        info = {
            "source_timestamp": attachment.time,
            "received_timestamp": received,
            "publication_sequence_number": attachment.sequence,
            "reception_sequence_number": None,
        }
        return partial(self.callback, message, info)

    def get_publisher_count(self) -> int:
        """Return the number of publishers whose messages arrive here."""
        return int(self.node.count_matching(Kind.PUBLISHER, self.entity))

    def destroy(self) -> None:
        """Withdraw the subscription, and forget the messages in the queue."""
        super().destroy()
        while self._queue.pop() is not None:
            pass
