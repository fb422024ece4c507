"""Services over DDS: a topic of requests, and one of replies.

Requests and replies name each other by inline parameters, as Fast DDS does it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

import msgspec

from idlc.robot.dds import formats, wire
from idlc.robot.dds.connection import Connection
from idlc.robot.dds.discovery import EndpointData
from idlc.robot.dds.formats import is_cyclone
from idlc.robot.dds.graph import HALVES, READER, WRITER, guid_of
from idlc.robot.dds.reader import Reader
from idlc.robot.dds.writer import Writer
from idlc.robot.keys import Entity, EntityKind, pack_attachment
from idlc.robot.names import dds_type
from idlc.robot.transport import OnReply, Request, Sample

#: The depth of histories, as nobody sends a lost request again.
_DEPTH = 1000
#: Seconds that a request waits for a service to appear, and a reply for its client.
_APPEARING = 5.0
#: What waits when another request is refused, and another reply, which anybody can cause.
_MOST_WAITING, _MOST_REPLIES = 10_000, 1000


class Pair(NamedTuple):
    """The two ends of a service or a client."""

    reader: Reader
    writer: Writer


class _Call(NamedTuple):
    """A request that waits for its reply."""

    attachment: bytes
    callback: OnReply
    end: float


class _Client:
    """The ends of a client, and its calls by the numbers of their requests."""

    def __init__(self) -> None:
        self.pair: Pair
        self.calls: dict[int, _Call] = {}

    def is_matched(self) -> bool:
        """Return whether a service is there."""
        reader, writer = self.pair
        return bool(writer.local or (writer.readers and reader.writers))

    def receive(self, received: wire.Data) -> None:
        """Take a reply; those to other clients arrive, too."""
        start = self.pair.reader.guid[:8]
        payload, named = formats.unwrap(received, start)
        if named is None or named[0] not in {each.guid for each in self.pair}:
            return
        if (call := self.calls.pop(named[1], None)) is not None:
            if not received.is_key:
                call.callback(Sample(payload, call.attachment))
            call.callback(None)

    def end_calls(self, now: float) -> None:
        """End the calls that nobody answers any more."""
        is_gone = not self.is_matched()
        late = [number for number, call in self.calls.items() if is_gone or call.end < now]
        for number in late:
            self.calls.pop(number).callback(None)


class _Waiting(NamedTuple):
    """A message to send as soon as the other side is matched; it is given up at `end`."""

    is_matched: Callable[[], bool]
    send: Callable[[], None]
    give_up: Callable[[], None]
    end: float


class _Request:
    """A request, which is answered to the client that sent it."""

    def __init__(self, services: Services, writer: Writer, received: wire.Data) -> None:
        self._services = services
        self._writer = writer
        self.payload, named = formats.unwrap(received, bytes(8))
        # Fast DDS names the reader of the reply
        self._target = named[0] if named else received.writer
        self._number = named[1] if named and is_cyclone(received.writer) else received.number
        self._client = received.writer[: wire.PREFIX]
        self.attachment = pack_attachment(received.number, time.time_ns(), self._target)

    def reply(self, payload: bytes, attachment: bytes) -> None:  # noqa: ARG002 - it is Zenoh's
        """Send the reply, now or when its client is matched."""
        named = formats.format_related(self._target, self._number)
        self._services.reply(self._writer, self._client, named, payload)

    def drop(self) -> None:
        """Finish without a reply; clients of idlc are told."""
        if self._target.startswith(wire.VENDOR):
            self.reply(b"", b"")


class Services:
    """The services and clients of a participant."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        #: By the id of an announced client, and the name and type of a service.
        self._clients: dict[object, _Client] = {}
        self._waiting: list[_Waiting] = []
        self._settled_at = 0.0

    def _pair(self, entity: Entity, deliver: Callable[[wire.Data], None]) -> Pair:
        """Declare the two ends of a service or a client."""
        qos = msgspec.structs.replace(entity.qos, depth=max(entity.qos.depth, _DEPTH))
        is_service = entity.kind is EntityKind.SERVICE
        ends = {}
        for half, (topic, type_) in HALVES.items():
            is_reader = is_service is (half == "rq")
            guid = guid_of(self._connection.prefix, entity.id + 1, READER if is_reader else WRITER)
            names = f"{half}{entity.name}{topic}", dds_type(entity.type) + type_
            ends[is_reader] = EndpointData(guid, *names, qos, service=entity.hash)
        with self._connection.acting() as participant:
            writer = participant.add_writer(ends[False])
            return Pair(participant.add_reader(ends[True], deliver), writer)

    def serve(self, entity: Entity, callback: Callable[[Request], None]) -> Pair:
        """Declare a service."""

        def deliver(received: wire.Data) -> None:
            if not received.is_key:
                callback(_Request(self, pair.writer, received))

        with self._connection.lock:
            pair = self._pair(entity, deliver)
            return pair

    def client(self, entity: Entity, *, is_announced: bool) -> _Client:
        """Return a client; those that are not announced share one for each service."""
        key = entity.id if is_announced else (entity.name, entity.type)
        client = self._clients.get(key)
        if client is None:
            client = self._clients[key] = _Client()
            client.pair = self._pair(entity, client.receive)
        return client

    def withdraw_client(self, entity: Entity) -> None:
        """Withdraw an announced client, which waits for nothing any more."""
        self._connection.remove(*(each.guid for each in self._clients.pop(entity.id).pair))

    def call(
        self, client: _Client, payload: bytes, attachment: bytes, callback: OnReply, limit: float
    ) -> None:
        """Send a request, now or when a service is matched."""

        def send() -> None:
            reader, writer = client.pair
            number = writer.last + 1
            # before it is sent, as a service of this participant may answer at once
            client.calls[number] = _Call(attachment, callback, time.monotonic() + limit)
            self._connection.write(writer, payload, formats.format_related(reader.guid, number))

        end = time.monotonic() + min(limit, _APPEARING)
        self._send(_Waiting(client.is_matched, send, lambda: callback(None), end), _MOST_WAITING)

    def reply(self, writer: Writer, client: bytes, named: bytes, payload: bytes) -> None:
        """Send the reply to a request of a participant, now or when its reader is matched."""

        def is_matched() -> bool:
            guids = (*writer.readers, *(reader.guid for reader in writer.local))
            return any(guid.startswith(client) for guid in guids)

        def send() -> None:
            self._connection.write(writer, payload, named)

        with self._connection.lock:
            end = time.monotonic() + _APPEARING
            self._send(_Waiting(is_matched, send, lambda: None, end), _MOST_REPLIES)

    def _send(self, message: _Waiting, most: int) -> None:
        """Send what can be sent, after what waited for the same end."""
        if self._connection.changed_at >= self._settled_at:
            self._settle(time.monotonic())
        if message.is_matched():
            message.send()
        elif len(self._waiting) < most:
            self._waiting.append(message)
        else:
            message.give_up()

    def _settle(self, now: float) -> None:
        self._settled_at = now
        waiting, self._waiting = self._waiting, []
        for each in waiting:
            if each.is_matched():
                each.send()
            elif each.end < now:
                each.give_up()
            else:
                self._waiting.append(each)

    def tick(self, now: float) -> None:
        """Send what waited, and end what is over."""
        self._settle(now)
        for client in [*self._clients.values()]:
            client.end_calls(now)
