"""Publishers and subscriptions, and streams for asyncio."""

from __future__ import annotations

from collections import deque
from collections.abc import AsyncGenerator, Callable
from contextlib import suppress
from functools import partial
from itertools import count
from threading import Lock
from time import time_ns
from typing import Any, ClassVar, Generic, TypeVar

from idlc.diagnostics.text import one_line
from idlc.robot.errors import RobotError
from idlc.robot.keys import ATTACHMENT, GID_SIZE, Entity, EntityKind, parse_attachment
from idlc.robot.nodes.clock import Timer
from idlc.robot.nodes.events import EventCallbacks, Events
from idlc.robot.nodes.executor import Ready
from idlc.robot.nodes.interfaces import M, interface_of
from idlc.robot.qos import HistoryPolicy, LivelinessPolicy, QoSProfile, qos_profile
from idlc.robot.transport import Closeable, Sample, unread_bytes
from idlc.runtime.names import DecodeError
from idlc.runtime.typeinfo import is_copy

T = TypeVar("T")

#: The bytes that wait in one queue; the newest message is kept, however large it is.
MOST_QUEUED = 256 * 2**20
#: The bytes that a message takes besides its payload.
_OVERHEAD = 512


class Endpoint(Ready):
    """The base class of publishers, subscriptions, services and clients.

    `node` is a Node, the class of which uses this one. `ignored` counts what others sent without
    an attachment, and what could not be decoded.
    """

    kind: ClassVar[EntityKind]
    deadline: Timer | None = None
    events: Events | None = None
    _is_measured = False

    def __init__(
        self, node: Any, name: str, kind: Any, qos: QoSProfile | int, group: Any, call: Any = None
    ) -> None:
        super().__init__(group or node.default_callback_group)
        self.node = node
        self.callback = call
        self.interface = interface_of(kind)
        self.qos_profile = qos_profile(qos)
        absolute: str = node.resolve_topic_name(name)
        #: The absolute name.
        self.topic_name = self.srv_name = absolute
        #: How the graph shows the endpoint.
        self.entity: Entity = node.entity.replace(
            name=absolute,
            id=node.session.next_id(),
            kind=self.kind,
            type=self.interface.name,
            hash=self.interface.hash,
            qos=self.qos_profile,
        )
        self.ignored = 0
        self._closeables = [*self.open(), node.transport.announce(self.entity)]
        node.add(self)

    def open(self) -> tuple[Closeable, ...]:
        """Declare the endpoint, before others see it; return what `destroy` closes."""
        raise NotImplementedError

    def destroy(self) -> None:
        """Withdraw the endpoint; may be called twice."""
        while self._closeables:
            self._closeables.pop().close()
        if self.events is not None:
            self.events.destroy()

    def watch(self, callbacks: EventCallbacks | None) -> None:
        """Call back for events."""
        if callbacks is not None:
            self.events = Events(self, callbacks)
            self.deadline = self.events.deadline

    def count_others(self, kind: EntityKind) -> int:
        """Return the number of endpoints with the same name, type and hash."""
        own = self.entity
        others = self.node.graph.entities(kind, own.name)
        return sum((other.type, other.hash) == (own.type, own.hash) for other in others)

    def encode(self, kind: Any, message: Any) -> bytes:
        """Return a message as CDR; raise TypeError if it is not of this class or a copy of it."""
        if not (isinstance(message, kind) or is_copy(kind, type(message))):
            needs = f"needs {kind.__name__}, not {type(message).__name__}"
            raise TypeError(f"`{self.topic_name}` of {self.interface.name} {needs}")
        payload: bytes = message.serialize()
        return payload

    def decode(self, kind: Any, payload: bytes) -> Any:
        """Return a message; warn once in a while and return `None` if it is not one.

        Warns if the first message has bytes that its type does not read.
        """
        try:
            message = kind.deserialize(payload)
        except DecodeError as error:
            self.ignored += 1
            text = f"`{self.topic_name}`: idlc ignores data that is not {self.interface.name}: "
            self.node.get_logger().warning(text + one_line(str(error)), throttle_duration_sec=10.0)
            return None
        if not self._is_measured:
            self._is_measured = True
            if unread := unread_bytes(payload, message):
                text = f"`{self.topic_name}`: a message has {unread:,} bytes that "
                text += f"{self.interface.name} does not read: the sender has another version of it"
                self.node.get_logger().warning(text)
        return message


class Bounded(Generic[T]):
    """A queue that drops the oldest items beyond a number, and beyond MOST_QUEUED bytes."""

    def __init__(self, qos: QoSProfile) -> None:
        self._depth = None if qos.history is HistoryPolicy.KEEP_ALL else qos.depth
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
            while self and (len(self) == self._depth or self._size + size > MOST_QUEUED):
                oldest, other = self._items.popleft()
                self._size -= oldest
                dropped.append(other)
            self._items.append((size, item))
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


class Publisher(Endpoint, Generic[M]):
    """Sends messages of a topic, from any thread."""

    kind = EntityKind.PUBLISHER

    def open(self) -> tuple[Closeable, ...]:
        """Declare the publisher."""
        sender = self.node.transport.publisher(self.entity)
        # looked up once, as each call and attribute is a few per cent of a small message
        self._put, self._pack = sender.put, ATTACHMENT.pack
        self._gid = self.node.transport.gid(self.entity)
        self._numbers = count(1)
        return (sender,)

    def publish(self, msg: M) -> None:
        """Send a message.

        Raises TypeError for another class, ValidationError for a value that its field cannot hold,
        and RobotError after the publisher was destroyed.
        """
        message: Any = msg
        kind = self.interface.kind
        # to call `encode` would double the time that `serialize` takes
        payload = message.serialize() if message.__class__ is kind else self.encode(kind, message)
        attachment = self._pack(next(self._numbers), time_ns(), GID_SIZE, self._gid)
        try:
            self._put(payload, attachment=attachment)
        except Exception as error:
            raise RobotError(f"`{self.topic_name}`: {one_line(str(error))}") from None
        if self.deadline is not None:
            self.deadline.begin_period()

    def assert_liveliness(self) -> None:
        """Do nothing, as the middleware does it; raise RobotError if the profile forbids that."""
        if self.qos_profile.liveliness is LivelinessPolicy.MANUAL_BY_TOPIC:
            problem = f"`{self.topic_name}`: idlc does not assert liveliness by hand"
            raise RobotError(problem, "use `LivelinessPolicy.AUTOMATIC`")

    def get_subscription_count(self) -> int:
        """Return the number of subscriptions that receive the messages."""
        return self.count_others(EntityKind.SUBSCRIPTION)


class Subscription(Endpoint, Generic[M]):
    """Receives messages of a topic: a queue that drops the oldest beyond the depth."""

    kind = EntityKind.SUBSCRIPTION

    def open(self) -> tuple[Closeable, ...]:
        """Declare the subscriber."""
        self._queue: Bounded[bytes] = Bounded(self.qos_profile)
        return (self.node.transport.subscriber(self.entity, self._receive),)

    def _receive(self, sample: Sample) -> None:
        attachment = parse_attachment(sample.attachment)
        if attachment is None:
            self.ignored += 1
            return
        if self.events is not None:
            self.events.note(attachment)
        self._queue.append(sample.payload, len(sample.payload))
        if self.deadline is not None:
            self.deadline.begin_period()
        self.wake()

    def next_message(self) -> Any:
        """Return the oldest message in the queue that can be decoded, `None` without one."""
        while (payload := self._queue.pop()) is not None:
            if (message := self.decode(self.interface.kind, payload)) is not None:
                return message
        return None

    def take(self) -> Callable[[], Any] | None:
        """Return the callback with the next message."""
        message = self.next_message()
        if self._queue:
            self.wake()
        return None if message is None else partial(self.callback, message)

    def get_publisher_count(self) -> int:
        """Return the number of publishers whose messages arrive here."""
        return self.count_others(EntityKind.PUBLISHER)


class RawSubscription(Subscription[Any]):
    """A subscription whose messages stay as they were sent."""

    def decode(self, _kind: Any, payload: bytes) -> bytes:
        """Return the bytes of a message, which may be anything."""
        return payload


class Stream(Subscription[M]):
    """A subscription that wakes a coroutine, and needs no executor."""

    def open(self) -> tuple[Closeable, ...]:
        """Declare the subscriber; the running event loop gets the messages."""
        import asyncio  # which other programs do not need

        self._loop = asyncio.get_running_loop()
        self._arrived = asyncio.Event()
        self.node.context.sleepers.add(self)
        return super().open()

    def wake(self) -> None:
        """Look at the queue and the context; for any thread."""
        if not self._is_queued:
            self._is_queued = True
            with suppress(RuntimeError):  # the loop is closed
                self._loop.call_soon_threadsafe(self._arrived.set)

    async def messages(self) -> AsyncGenerator[M, None]:
        """Yield the messages, until the context is shut down or the subscription destroyed."""
        try:
            while self in self.node.endpoints and self.node.context.ok():
                self._arrived.clear()
                self._is_queued = False
                if (message := self.next_message()) is not None:
                    yield message
                else:
                    await self._arrived.wait()
        finally:
            self.node.destroy_subscription(self)
