"""The transport over Zenoh, with the options that rmw_zenoh uses."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from queue import SimpleQueue
from typing import Any

import zenoh
from zenoh import CongestionControl, Reliability, ext

from idlc.project.atomic import without_ctrl_c
from idlc.robot.keys import Entity, all_tokens, parse_token
from idlc.robot.qos import HistoryPolicy
from idlc.robot.transport import Closeable, OnReply, Request, Sample, Sender

#: Seconds between the heartbeats by which subscriptions notice that they missed a message.
_HEARTBEAT = 0.5
#: Tokens that wait to be read; more are lost.
_MOST_WAITING = 2**18


class ZenohTransport:
    """The declarations of one Zenoh session.

    Zenoh can call back before one of its functions returns. It prints exceptions of callbacks and
    goes on, so that a KeyboardInterrupt would be lost there.
    """

    connects_all = True

    def __init__(self, session: zenoh.Session) -> None:
        self._session: Any = session
        self._liveliness = session.liveliness()
        self.id = str(session.info.zid())
        #: Zenoh withdraws declarations that nobody refers to.
        self._declared: set[_Declared] = set()

    def gid(self, entity: Entity) -> bytes:
        """Return the hash of the token."""
        return entity.gid

    def publisher(self, entity: Entity) -> Sender:
        """Declare a publisher."""
        key, qos = entity.key, entity.qos
        reliable = qos.is_reliable
        blocks = reliable and qos.history is HistoryPolicy.KEEP_ALL
        options: dict[str, Any] = {
            "congestion_control": CongestionControl.BLOCK if blocks else CongestionControl.DROP,
            "reliability": Reliability.RELIABLE if reliable else Reliability.BEST_EFFORT,
        }
        if not qos.is_latched:
            return _Sender(self._declared, self._session.declare_publisher(key, **options))
        options["cache"] = ext.CacheConfig(max_samples=qos.depth)
        if reliable:
            heartbeats = ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=_HEARTBEAT)
            options["sample_miss_detection"] = heartbeats
        publisher = ext.declare_advanced_publisher(
            self._session, key, publisher_detection=True, **options
        )
        return _LatchedSender(self._declared, publisher)

    def subscriber(self, entity: Entity, callback: Callable[[Sample], None]) -> Closeable:
        """Declare a subscriber."""
        key, qos = entity.key, entity.qos

        def put(sample: zenoh.Sample) -> None:
            if sample.kind == zenoh.SampleKind.PUT:
                callback(_sample(sample))

        if not qos.is_latched:
            subscriber = self._session.declare_subscriber(key, _direct(put))
            return _Declared(self._declared, subscriber)
        options: dict[str, Any] = {}
        if qos.is_reliable:
            options["recovery"] = ext.RecoveryConfig(periodic_queries=None, heartbeat=True)
        history = ext.HistoryConfig(detect_late_publishers=True, max_samples=qos.depth)
        subscriber = ext.declare_advanced_subscriber(
            self._session, key, _direct(put), subscriber_detection=True, history=history, **options
        )
        return _Declared(self._declared, subscriber)

    def service(self, entity: Entity, callback: Callable[[Request], None]) -> Closeable:
        """Declare a queryable."""
        key = entity.key
        receive = _direct(lambda query: callback(_Request(query, key)))
        queryable = self._session.declare_queryable(key, receive, complete=True)
        return _Declared(self._declared, queryable)

    @without_ctrl_c()
    def call(
        self,
        entity: Entity,
        payload: bytes,
        attachment: bytes,
        callback: OnReply,
        *,
        timeout: float,
    ) -> None:
        """Send a query to all services."""

        def answer(reply: zenoh.Reply) -> None:
            if (sample := reply.ok) is not None:
                callback(_sample(sample))

        self._session.get(
            entity.key,
            _direct(answer, lambda: callback(None)),
            payload=payload,
            attachment=attachment,
            target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=timeout,
        )

    @without_ctrl_c()
    def announce(self, entity: Entity) -> Closeable:
        """Declare a liveliness token."""
        return _Declared(self._declared, self._liveliness.declare_token(entity.token))

    @without_ctrl_c()
    def watch(self, domain: int, callback: Callable[[Entity, bool], None]) -> Closeable:
        """Subscribe to liveliness tokens, with those that exist."""

        def receive(sample: zenoh.Sample) -> None:
            if entity := parse_token(str(sample.key_expr)):
                callback(entity, sample.kind == zenoh.SampleKind.PUT)

        pattern = all_tokens(domain)
        subscriber = self._liveliness.declare_subscriber(pattern, _direct(receive), history=True)
        return _Declared(self._declared, subscriber)

    def entities(self, domain: int | None, timeout: float) -> Iterator[Entity]:
        """Query the liveliness tokens that exist."""
        # The session answers from its own memory before `get` returns, so nothing may block there
        replies: SimpleQueue[Any] = SimpleQueue()

        def receive(reply: zenoh.Reply) -> None:
            if reply.ok is None or replies.qsize() < _MOST_WAITING:
                replies.put(reply)

        end = partial(replies.put, None)
        with without_ctrl_c():
            self._liveliness.get(all_tokens(domain), _direct(receive, end), timeout=timeout)
        while (reply := replies.get()) is not None:
            if reply.ok is None:
                raise TimeoutError
            if entity := parse_token(str(reply.ok.key_expr)):
                yield entity

    def pump(self, timeout: float, is_idle: Callable[[], bool]) -> bool:  # noqa: ARG002
        """Return False, as Zenoh's own threads receive."""
        return False

    def wake(self) -> None:
        """Do nothing, as `pump` does not wait."""

    def notes(self) -> list[str]:
        """Return nothing."""
        return []

    def close(self) -> None:
        """Close the Zenoh session."""
        with suppress(zenoh.ZError):  # it is closed already, or gives up after ten seconds
            self._session.close()


def _direct(callback: Callable[[Any], None], end: Callable[[], None] = lambda: None) -> Any:
    """Return a callback for Zenoh's own threads, as Zenoh never forgets one for another thread."""
    return zenoh.handlers.Callback(callback, end, indirect=False)


class _Declared:
    """A declaration; Zenoh itself does not let it be withdrawn twice."""

    def __init__(self, declared: set[_Declared], declaration: Any) -> None:
        self._declared = declared
        self._declaration = declaration
        declared.add(self)

    @without_ctrl_c()
    def close(self) -> None:
        """Withdraw it."""
        if self not in self._declared:
            return
        self._declared.discard(self)
        declaration, self._declaration = self._declaration, None
        # Zenoh withdraws a forgotten one. `undeclare` of this class keeps the GIL while it waits
        # for a task, for ten seconds if a callback on the thread of that task waits for the GIL.
        if not isinstance(declaration, ext.AdvancedPublisher):
            declaration.undeclare()


class _Sender(_Declared):
    def __init__(self, declared: set[_Declared], declaration: Any) -> None:
        super().__init__(declared, declaration)
        #: Sends a message; Zenoh's own method, as one of ours would take a tenth more time.
        self.put = declaration.put


class _LatchedSender(_Declared):
    def put(self, payload: bytes, *, attachment: bytes) -> None:
        """Send a message."""
        if self not in self._declared:
            raise RuntimeError("the publisher is closed")
        self._declaration.put(payload, attachment=attachment)


class _Request:
    def __init__(self, query: zenoh.Query, key: str) -> None:
        self._query: Any = query
        self._key = key
        self.payload = _bytes(query.payload)
        self.attachment = _bytes(query.attachment)

    def reply(self, payload: bytes, attachment: bytes) -> None:
        """Send the reply, and finish the query."""
        self._query.reply(self._key, payload, attachment=attachment)
        self.drop()

    def drop(self) -> None:
        """Finish the query."""
        self._query.drop()


def _sample(sample: zenoh.Sample) -> Sample:
    return Sample(sample.payload.to_bytes(), _bytes(sample.attachment))


def _bytes(data: zenoh.ZBytes | None) -> bytes:
    return b"" if data is None else data.to_bytes()
