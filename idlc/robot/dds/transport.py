"""The transport over DDS: the entities of ROS 2 as endpoints of a participant."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import NamedTuple

from idlc.robot.dds import graph
from idlc.robot.dds.address import Place, silence
from idlc.robot.dds.connection import Connection
from idlc.robot.dds.discovery import EndpointData
from idlc.robot.dds.graph import READER, WRITER, RemoteNodes, guid_of, own_nodes
from idlc.robot.dds.services import Services
from idlc.robot.dds.wire import Data
from idlc.robot.dds.writer import Writer, unpadded
from idlc.robot.keys import Entity, EntityKind, pack_attachment
from idlc.robot.names import dds_type
from idlc.robot.qos import DurabilityPolicy, QoSProfile
from idlc.robot.transport import Closeable, OnReply, Request, Sample, Sender

_INFO_ID = 0xFFFFF0
_INFO_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
#: Seconds without a change after which the others have told all, nobody is there, or those that
#: are there tell nothing more.
_SETTLED, _ALONE, _PATIENCE = 0.3, 1.0, 3.0
#: Seconds between two messages about the own nodes.
_PERIOD = 0.05


def _closing(withdraw: Callable[..., None], *args: object) -> Closeable:
    """Return a declaration, which is withdrawn once."""
    declaration = ExitStack()
    declaration.callback(withdraw, *args)
    return declaration


class _Sender(NamedTuple):
    connection: Connection
    writer: Writer

    def put(self, payload: bytes, *, attachment: bytes) -> None:  # noqa: ARG002 - it is Zenoh's
        """Send a message."""
        if self.writer.is_closed:
            raise RuntimeError("the publisher is closed")
        self.connection.write(self.writer, payload)

    def close(self) -> None:
        """Withdraw the writer."""
        self.connection.remove(self.writer.guid)


class DdsTransport:
    """The declarations of one participant."""

    connects_all = False

    def __init__(self, place: Place) -> None:
        self.place = place
        self._own: dict[str, Entity] = {}
        self._remote = RemoteNodes(place.domain)
        self._watchers: list[Callable[[Entity, bool], None]] = []
        self._shown: dict[str, Entity] = {}
        self._refreshed = self._refresh_at = 0.0
        self._is_stale = True
        #: Whether the others have to be told about the own nodes, and when that is due.
        self._is_news, self._news_at = False, 0.0
        self._connection = Connection(place, self._tick)
        self._services = Services(self._connection)
        self._started = time.monotonic()
        self.id = self._connection.prefix.hex()
        about = graph.INFO_TOPIC, graph.INFO_TYPE, _INFO_QOS, graph.INFO_HASH
        writer, reader = (
            EndpointData(self._guid(_INFO_ID, kind), *about) for kind in (WRITER, READER)
        )
        with self._connection.acting() as participant:
            self._info = participant.add_writer(writer)
            self._infos = participant.add_reader(reader, self._learn)
        self._connection.start()

    def pump(self, timeout: float, is_idle: Callable[[], bool]) -> bool:
        """Receive on this thread."""
        return self._connection.pump(timeout, is_idle)

    def wake(self) -> None:
        """End `pump`."""
        self._connection.wake()

    def _guid(self, number: int, kind: bytes) -> bytes:
        return guid_of(self._connection.prefix, number, kind)

    def gid(self, entity: Entity) -> bytes:
        """Return the GUID of the writer, or of the reader of a subscription."""
        is_reader = entity.kind is EntityKind.SUBSCRIPTION
        return self._guid(entity.id + 1, READER if is_reader else WRITER)

    # endpoints

    def _topic(self, entity: Entity, kind: bytes) -> EndpointData:
        guid, type_ = self._guid(entity.id + 1, kind), dds_type(entity.type)
        return EndpointData(guid, f"rt{entity.name}", type_, entity.qos, entity.hash)

    def publisher(self, entity: Entity) -> Sender:
        """Declare a writer."""
        with self._connection.acting() as participant:
            return _Sender(self._connection, participant.add_writer(self._topic(entity, WRITER)))

    def subscriber(self, entity: Entity, callback: Callable[[Sample], None]) -> Closeable:
        """Declare a reader."""

        def deliver(received: Data) -> None:
            if not received.is_key:
                sent = received.time or time.time_ns()
                attachment = pack_attachment(received.number, sent, received.writer)
                callback(Sample(unpadded(received.payload), attachment))

        with self._connection.acting() as participant:
            reader = participant.add_reader(self._topic(entity, READER), deliver)
        return _closing(self._connection.remove, reader.guid)

    def service(self, entity: Entity, callback: Callable[[Request], None]) -> Closeable:
        """Declare the ends of a service."""
        pair = self._services.serve(entity, callback)
        return _closing(self._connection.remove, *(each.guid for each in pair))

    def call(
        self,
        entity: Entity,
        payload: bytes,
        attachment: bytes,
        callback: OnReply,
        *,
        timeout: float,
    ) -> None:
        """Send a request as soon as a service is there; only the first reply counts."""
        with self._connection.lock:
            client = self._services.client(entity, is_announced=entity.token in self._own)
            self._services.call(client, payload, attachment, callback, timeout)

    def _tick(self) -> None:
        """Do what is due."""
        now = time.monotonic()
        self._services.tick(now)
        if self._is_news and now >= self._news_at:
            self._publish(now)
        is_changed = self._is_stale or self._connection.changed_at > self._refreshed
        if is_changed and now >= self._refresh_at:
            self._refresh()

    # the graph

    def announce(self, entity: Entity) -> Closeable:
        """Tell the others about a node, or that an endpoint is of its node."""
        with self._connection.lock:
            self._own[entity.token] = entity
            if entity.kind is EntityKind.CLIENT:
                self._services.client(entity, is_announced=True)
            self._change()
        return _closing(self._conceal, entity)

    def _conceal(self, entity: Entity) -> None:
        with self._connection.lock:
            del self._own[entity.token]
            if entity.kind is EntityKind.CLIENT:
                self._services.withdraw_client(entity)
            self._change()

    def _change(self) -> None:
        """Tell all about the own nodes; many changes at a time are one message."""
        self._is_news = self._is_stale = True
        if (now := time.monotonic()) >= self._news_at:
            self._publish(now)

    def _publish(self, now: float) -> None:
        """Send the own nodes and their endpoints."""
        prefix = self._connection.prefix
        payload = graph.format_info(prefix, own_nodes(prefix, self._own.values()))
        self._connection.write(self._info, payload)
        self._is_news, self._news_at = False, now + _PERIOD

    def _learn(self, received: Data) -> None:
        self._is_stale |= self._remote.learn(received)

    def _all(self) -> dict[str, Entity]:
        """Return all nodes and endpoints, by their tokens."""
        participant = self._connection.participant
        hashes = {(own.name, own.type): own.hash for own in self._own.values()}
        remote = self._remote.entities([*participant.peers], participant.remote_endpoints(), hashes)
        return self._own | {entity.token: entity for entity in remote}

    def _refresh(self) -> None:
        """Tell the watchers what changed in the graph."""
        self._refreshed, self._is_stale = time.monotonic(), False
        shown, self._shown = self._shown, self._all()
        for watcher in self._watchers:
            for token in shown.keys() - self._shown.keys():
                watcher(shown[token], False)
            for token, entity in self._shown.items():
                if token not in shown:
                    watcher(entity, True)
        # a graph that takes long, as somebody makes it large, takes a part of the time
        now = time.monotonic()
        self._refresh_at = now + 4 * (now - self._refreshed)

    def watch(
        self,
        domain: int,  # noqa: ARG002 - a participant knows one domain
        callback: Callable[[Entity, bool], None],
    ) -> Closeable:
        """Call back with the entities of the graph."""
        with self._connection.lock:
            self._refresh()
            self._watchers.append(callback)
            for entity in self._shown.values():
                callback(entity, True)
        return _closing(self._watchers.remove, callback)

    def entities(self, domain: int | None, timeout: float) -> Iterator[Entity]:  # noqa: ARG002
        """Yield the entities that exist, as soon as the others have told all of theirs."""
        end, is_told, is_over = time.monotonic() + timeout, False, False
        while not is_over and time.monotonic() < end:
            time.sleep(0.02)
            with self._connection.lock:
                participant = self._connection.participant
                is_told = participant.is_told and self._infos.is_complete
                patience = _SETTLED if participant.peers else _ALONE
            if not is_told:
                patience = _PATIENCE
            quiet = time.monotonic() - max(self._started, self._connection.changed_at)
            is_over = quiet > patience
        with self._connection.lock:
            yield from self._all().values()
        if not is_told:
            raise TimeoutError

    def notes(self) -> list[str]:
        """Return the variables that idlc does not use, and where it did not find anybody."""
        participant = self._connection.participant
        notes = [*self.place.notes]
        if not participant.peers:
            notes.append(silence(self.place))
        if participant.without_udp:
            notes.append("some participants offer no UDP over IPv4; idlc does not see them")
        if participant.refused:
            notes.append("there are too many participants or endpoints; some are missing")
        return notes

    def close(self) -> None:
        """Leave; all declarations end."""
        self._connection.close()
