"""Services over DDS: a topic of requests, and one of replies.

Requests and replies name each other by inline parameters, as Fast DDS does it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

import msgspec

from idlc.robot.dds import discovery, wire
from idlc.robot.dds.connection import Connection
from idlc.robot.dds.discovery import Endpoint
from idlc.robot.dds.graph import HALVES, READER, WRITER, guid_of
from idlc.robot.dds.reader import Reader, Received
from idlc.robot.dds.writer import Writer
from idlc.robot.keys import Entity, Kind, pack_attachment
from idlc.robot.names import dds_type
from idlc.robot.transport import OnReply, Request, Sample

#: The depth of histories, as nobody sends a lost request again.
_DEPTH = 1000
#: Seconds that a request waits for a service to appear, and a reply for its client.
_APPEARING = 5.0
#: Replies that wait for their clients.
_MOST_WAITING = 1000


class Pair(NamedTuple):
    """The two ends of a service or a client."""

    reader: Reader
    writer: Writer


class _Call:
    """A request that waits for a service, or for its reply."""

    def __init__(self, payload: bytes, attachment: bytes, callback: OnReply, limit: float) -> None:
        self.payload = payload
        self.attachment = attachment
        self.callback = callback
        #: Seconds until the reply, and when the present wait is over.
        self.limit = limit
        self.end = time.monotonic() + min(limit, _APPEARING)


class _Client:
    """The ends of a client, and its calls: those that wait for a service, and those by number."""

    def __init__(self) -> None:
        self.pair: Pair
        self.waiting: list[_Call] = []
        self.sent: dict[int, _Call] = {}

    @property
    def is_matched(self) -> bool:
        """True if a service is there."""
        reader, writer = self.pair
        return bool(writer.local or (writer.readers and reader.writers))

    def receive(self, received: Received) -> None:
        """Take a reply; those to other clients arrive, too."""
        named = discovery.related(received.parameters)
        if named is None or named[0] not in {each.guid for each in self.pair}:
            return
        if (call := self.sent.pop(named[1], None)) is not None:
            if not received.is_key:
                call.callback(Sample(received.payload, call.attachment))
            call.callback(None)


class _Reply(NamedTuple):
    """A reply that waits for its client."""

    writer: Writer
    target: bytes
    payload: bytes
    inline: bytes
    end: float


class _Request:
    """A request, which is answered to the client that sent it."""

    def __init__(self, services: Services, writer: Writer, received: Received) -> None:
        self._services = services
        self._writer = writer
        named = discovery.related(received.parameters)
        # Fast DDS names the reader of the reply
        self._target = named[0] if named else received.writer
        self._number = received.number
        self.payload = received.payload
        self.attachment = pack_attachment(received.number, time.time_ns(), self._target)

    def reply(self, payload: bytes, attachment: bytes) -> None:  # noqa: ARG002 - it is Zenoh's
        """Send the reply."""
        inline = discovery.format_related(self._target, self._number)
        self._services.reply(self._writer, self._target, payload, inline)

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
        self._replies: list[_Reply] = []

    def _pair(self, entity: Entity, deliver: Callable[[Received], None]) -> Pair:
        """Declare the two ends of a service or a client."""
        qos = msgspec.structs.replace(entity.qos, depth=max(entity.qos.depth, _DEPTH))
        is_service = entity.kind is Kind.SERVICE
        ends = {}
        for half, is_reader in (("rq", is_service), ("rr", not is_service)):
            names = (f"{half}{entity.name}{HALVES[half][0]}", dds_type(entity.type))
            guid = guid_of(self._connection.prefix, entity.id + 1, READER if is_reader else WRITER)
            end = Endpoint(guid, names[0], names[1] + HALVES[half][1], qos, entity.hash)
            ends[is_reader] = end
        writer = self._connection.add_writer(ends[False])
        return Pair(self._connection.add_reader(ends[True], deliver), writer)

    def withdraw(self, pair: Pair) -> None:
        """Withdraw both ends."""
        for each in pair:
            self._connection.remove(each.guid)

    def serve(self, entity: Entity, callback: Callable[[Request], None]) -> Pair:
        """Declare a service."""

        def deliver(received: Received) -> None:
            if not received.is_key:
                callback(_Request(self, pair.writer, received))

        with self._connection.lock:
            pair = self._pair(entity, deliver)
            return pair

    def reply(self, writer: Writer, target: bytes, payload: bytes, inline: bytes) -> None:
        """Send a reply, now or when its client is matched."""
        with self._connection.lock:
            if _is_matched(writer, target):
                self._connection.write(writer, payload, inline)
            elif len(self._replies) < _MOST_WAITING:
                end = time.monotonic() + _APPEARING
                self._replies.append(_Reply(writer, target, payload, inline, end))

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
        self.withdraw(self._clients.pop(entity.id).pair)

    def call(
        self, client: _Client, payload: bytes, attachment: bytes, callback: OnReply, limit: float
    ) -> None:
        """Send a request, now or when a service is matched."""
        call = _Call(payload, attachment, callback, limit)
        if client.is_matched and not client.waiting:
            self._send(client, call)
        else:
            client.waiting.append(call)

    def _send(self, client: _Client, call: _Call) -> None:
        reader, writer = client.pair
        call.end = time.monotonic() + call.limit
        # before it is sent, as a service of this participant may answer at once
        client.sent[writer.last + 1] = call
        inline = discovery.format_related(reader.guid, writer.last + 1)
        self._connection.write(writer, call.payload, inline)

    def tick(self, now: float) -> None:
        """Send what waited, and end what is over."""
        for client in [*self._clients.values()]:
            while client.waiting and client.is_matched:
                self._send(client, client.waiting.pop(0))
            is_gone = not client.is_matched
            late = [call for call in client.waiting if call.end < now]
            client.waiting = [call for call in client.waiting if call.end >= now]
            late += (call for call in client.sent.values() if is_gone or call.end < now)
            client.sent = {n: call for n, call in client.sent.items() if call not in late}
            for call in late:
                call.callback(None)
        replies, self._replies = self._replies, []
        for reply in replies:
            if _is_matched(reply.writer, reply.target):
                self._connection.write(reply.writer, reply.payload, reply.inline)
            elif reply.end > now:
                self._replies.append(reply)


def _is_matched(writer: Writer, target: bytes) -> bool:
    """Return whether a writer reaches the participant of a reader."""
    guids = (*writer.readers, *(reader.guid for reader in writer.local))
    return any(guid.startswith(target[: wire.PREFIX]) for guid in guids)
