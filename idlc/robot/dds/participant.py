"""A participant: it meets others, learns of their endpoints, and matches them with its own.

It has no sockets and no clock: `receive` takes a packet, its source and the time, and returns the
packets to send; `deadline` is when `tick` has something to do. A stranger, who has not yet named
this participant in a packet, gets at most three announcements. All packets to a peer go to the
IP address that its own packets came from, as an announced one may belong to somebody else.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator

from idlc.robot.dds import discovery, formats, wire
from idlc.robot.dds.discovery import Endpoint, Peer, fits
from idlc.robot.dds.reader import Address, Outgoing, Reader, Received
from idlc.robot.dds.writer import Writer
from idlc.robot.qos import QoSProfile

#: Participants, the announcements that a stranger gets, and the endpoints of one participant.
MOST_PEERS = 256
MOST_ANNOUNCEMENTS = 3
#: Announcements to strangers between two of the periodic ones, whatever names they use.
MOST_GREETINGS = 256
MOST_ENDPOINTS = 4096
#: Ends of own endpoints that late participants are still told of.
_ENDS = 256
#: Seconds between announcements: the first ones come fast.
_PERIODS = (0.1, 0.2, 0.4, 0.8, 1.6)
_PERIOD = 3.0


class Participant:
    """The endpoints of this program, and what it knows of others.

    `searched` are the addresses where others may listen. `fragment` returns the most bytes of a
    fragment for a host. `changed` is called after each change of the remote endpoints.
    """

    def __init__(
        self,
        prefix: bytes,
        addresses: Iterable[Address],
        searched: Iterable[Address],
        fragment: Callable[[str], int],
        changed: Callable[[], None] = lambda: None,
    ) -> None:
        self.prefix = prefix
        self.peers: dict[bytes, Peer] = {}
        #: Strangers beyond the limit, participants that offer no UDP, and malformed packets.
        self.refused = self.without_udp = self.malformed = 0
        self._announcement = discovery.format_participant(prefix, addresses)
        self._searched = [*searched]
        self._fragment = fragment
        self._changed = changed
        self._writers: dict[bytes, Writer] = {}
        self._readers: dict[bytes, Reader] = {}
        self._local: dict[bytes, Endpoint] = {}
        self._numbers: dict[bytes, int] = {}
        self._ends: deque[tuple[bool, int]] = deque()
        self._periods = iter(_PERIODS)
        self._announce_at = 0.0
        self._greetings = 0
        #: The answers to the packet that is being read, and its time.
        self._out: list[Outgoing] = []
        self._now = 0.0
        for writer, reader in discovery.SEDP.values():
            self._writers[writer] = Writer(prefix + writer, discovery.SEDP_QOS)
            self._readers[reader] = Reader(prefix + reader, discovery.SEDP_QOS, self._learn)

    # own endpoints

    def add_writer(self, end: Endpoint, now: float) -> tuple[Writer, list[Outgoing]]:
        """Announce a writer."""
        writer = self._writers[end.guid[wire.PREFIX :]] = Writer(end.guid, end.qos)
        return writer, self._add(end, now)

    def add_reader(
        self, end: Endpoint, deliver: Callable[[Received], None], now: float
    ) -> tuple[Reader, list[Outgoing]]:
        """Announce a reader."""
        reader = self._readers[end.guid[wire.PREFIX :]] = Reader(end.guid, end.qos, deliver)
        return reader, self._add(end, now)

    def _add(self, end: Endpoint, now: float) -> list[Outgoing]:
        announcer = self._writers[discovery.SEDP[end.is_writer][0]]
        out = announcer.write(discovery.format_endpoint(end), b"", 0, now)
        self._numbers[end.guid] = announcer.last
        for other in self._local.values():
            writer, reader = (end, other) if end.is_writer else (other, end)
            if other.is_writer != end.is_writer and fits(writer, reader):
                near = self._readers[reader.guid[wire.PREFIX :]]
                self._writers[writer.guid[wire.PREFIX :]].match_local(near)
        self._local[end.guid] = end
        for peer in self.peers.values():
            for other in peer.endpoints.values():
                out += self._match(end, other, peer, now)
        return out

    def remove(self, guid: bytes, now: float) -> list[Outgoing]:
        """Withdraw an endpoint."""
        end = self._local.pop(guid, None)
        if end is None:
            return []
        self._writers.pop(guid[wire.PREFIX :], None)
        reader = self._readers.pop(guid[wire.PREFIX :], None)
        for writer in self._writers.values():
            writer.local = [local for local in writer.local if local is not reader]
        announcer = self._writers[discovery.SEDP[end.is_writer][0]]
        announcer.forget(self._numbers.pop(guid))
        out = announcer.write(b"", discovery.format_end(guid), 0, now)
        self._ends.append((end.is_writer, announcer.last))
        if len(self._ends) > _ENDS:
            is_writer, number = self._ends.popleft()
            self._writers[discovery.SEDP[is_writer][0]].forget(number)
        return out

    def leave(self) -> list[Outgoing]:
        """Return what tells all that this participant ends."""
        end = discovery.format_end(self.prefix + discovery.PARTICIPANT_ID)
        part = formats.format_data(discovery.SPDP_READER, discovery.SPDP_WRITER, 2, end, b"")
        return [Outgoing(peer.meta, bytes(wire.PREFIX), (part,)) for peer in self.peers.values()]

    def _match(self, own: Endpoint, other: Endpoint, peer: Peer, now: float) -> list[Outgoing]:
        """Connect two ends if they fit."""
        writer, reader = (own, other) if own.is_writer else (other, own)
        if own.is_writer == other.is_writer or not fits(writer, reader):
            return []
        name, address = own.guid[wire.PREFIX :], peer.address(other)
        return self._connect(own.is_writer, name, other.guid, address, other.qos, now)

    def _connect(
        self,
        is_writer: bool,
        name: bytes,
        guid: bytes,
        address: Address,
        qos: QoSProfile,
        now: float,
    ) -> list[Outgoing]:
        if is_writer:
            size = self._fragment(address[0])
            return self._writers[name].match(guid, address, qos, size, now)
        self._readers[name].match(guid, address, qos)
        question = self._readers[name].ask(guid)
        return [question] if question else []

    def _learn(self, sample: Received) -> None:
        """Take an announcement of an endpoint."""
        peer = self.peers.get(sample.writer[: wire.PREFIX])
        if peer is None:
            return
        if (guid := discovery.ended(wire.Data(b"", b"", *sample[1:]))) is not None:
            if peer.endpoints.pop(guid, None):
                self._unmatch(guid)
                self._changed()
            return
        try:
            end = discovery.parse_endpoint(sample.payload)
        except (wire.WireError, ValueError):
            self.malformed += 1
            return
        is_new = end.guid in peer.endpoints or len(peer.endpoints) < MOST_ENDPOINTS
        if end.guid[: wire.PREFIX] != peer.about.prefix or not is_new:
            self.refused += 1
            return
        peer.endpoints[end.guid] = end
        for own in [*self._local.values()]:
            self._out += self._match(own, end, peer, self._now)
        self._changed()

    def _unmatch(self, guid: bytes) -> None:
        for writer in self._writers.values():
            writer.unmatch(guid)
        for reader in self._readers.values():
            reader.unmatch(guid)

    # others

    def _meet(self, part: wire.Data, host: str, now: float) -> list[Outgoing]:
        """Take an announcement of a participant."""
        if (guid := discovery.ended(part)) is not None:
            peer = self.peers.get(guid[: wire.PREFIX])
            if peer is not None and peer.host == host:
                self._lose(peer)
            return []
        try:
            about = discovery.parse_participant(part.payload)
        except wire.WireError:
            self.malformed += 1
            return []
        if about.prefix == self.prefix:
            return []
        if not about.meta_port:
            self.without_udp += 1
            return []
        peer = self.peers.get(about.prefix)
        if peer is None:
            if len(self.peers) >= MOST_PEERS and not self._make_room():
                self.refused += 1
                return []
            peer = self.peers[about.prefix] = Peer(about, host, now)
        if peer.host != host:
            return []
        peer.about = about._replace(meta_port=peer.about.meta_port) if peer.is_known else about
        peer.seen = now
        return self._greet(peer)

    def _make_room(self) -> bool:
        """Forget the oldest stranger."""
        for peer in self.peers.values():
            if not peer.is_known:
                del self.peers[peer.about.prefix]
                return True
        return False

    def _greet(self, peer: Peer) -> list[Outgoing]:
        """Announce this participant to one that does not know it yet, not for ever."""
        is_over = peer.announced >= MOST_ANNOUNCEMENTS or self._greetings >= MOST_GREETINGS
        if peer.is_known or is_over:
            return []
        peer.announced += 1
        self._greetings += 1
        return [self._announce_to(peer.meta, peer.about.prefix)]

    def _announce_to(self, address: Address, prefix: bytes) -> Outgoing:
        part = formats.format_data(
            discovery.SPDP_READER, discovery.SPDP_WRITER, 1, b"", self._announcement
        )
        return Outgoing(address, prefix, (part,))

    def _know(self, peer: Peer, now: float) -> list[Outgoing]:
        """Exchange endpoints with a peer that has named this participant."""
        peer.is_known = True
        out = []
        for writer, reader in discovery.SEDP.values():
            prefix = peer.about.prefix
            out += self._connect(True, writer, prefix + reader, peer.meta, discovery.SEDP_QOS, now)
            out += self._connect(False, reader, prefix + writer, peer.meta, discovery.SEDP_QOS, now)
        return out

    def _lose(self, peer: Peer) -> None:
        """Forget a peer and all of it."""
        del self.peers[peer.about.prefix]
        for guid in [*peer.endpoints]:
            self._unmatch(guid)
        for writer, reader in discovery.SEDP.values():
            self._writers[writer].unmatch(peer.about.prefix + reader)
            self._readers[reader].unmatch(peer.about.prefix + writer)
        if peer.endpoints:
            self._changed()

    # packets and time

    def receive(self, packet: bytes, source: Address, now: float) -> list[Outgoing]:
        """Take a packet; return the answers."""
        try:
            prefix, _vendor, parts = wire.parse_packet(packet)
        except wire.WireError:
            self.malformed += 1
            return []
        if prefix == self.prefix:
            return []
        self._out, self._now = [], now
        peer = self.peers.get(prefix)
        for destination, part in parts:
            if destination not in (self.prefix, bytes(wire.PREFIX)):
                continue
            if isinstance(part, wire.Data) and part.writer == discovery.SPDP_WRITER:
                self._out += self._meet(part, source[0], now)
                peer = self.peers.get(prefix)
            if peer is None:
                continue
            if not peer.is_known:
                if destination != self.prefix or peer.host != source[0]:
                    continue
                self._out += self._know(peer, now)
            peer.seen = now
            if part.writer != discovery.SPDP_WRITER:
                self._pass(prefix, part, now)
        out, self._out = self._out, []
        return out

    def _pass(self, prefix: bytes, part: wire.Part, now: float) -> None:
        """Pass a part on to the endpoint that it is for."""
        if isinstance(part, (wire.AckNack, wire.NackFragment)):
            writer = self._writers.get(part.writer)
            if writer is None:
                return
            guid = prefix + part.reader
            if isinstance(part, wire.AckNack):
                self._out += writer.acknack(guid, part, now)
            else:
                self._out += writer.nack_fragment(guid, part)
            return
        guid = prefix + part.writer
        for reader in self._readers_for(part.reader, guid):
            if isinstance(part, wire.Data):
                reader.data(guid, part)
            elif isinstance(part, wire.Fragment):
                reader.fragment(guid, part)
            elif isinstance(part, wire.Heartbeat):
                self._out += reader.heartbeat(guid, part)
            else:
                reader.gap(guid, part)

    def _readers_for(self, name: bytes, writer: bytes) -> Iterable[Reader]:
        if name != bytes(4):
            return filter(None, [self._readers.get(name)])
        return [reader for reader in self._readers.values() if writer in reader.writers]

    @property
    def deadline(self) -> float:
        """When `tick` has something to do."""
        times = [writer.deadline for writer in self._writers.values()]
        return min([self._announce_at, *(time for time in times if time is not None)])

    def tick(self, now: float) -> list[Outgoing]:
        """Do what is due."""
        out: list[Outgoing] = []
        for writer in self._writers.values():
            out += writer.tick(now)
        if now >= self._announce_at:
            self._announce_at = now + next(self._periods, _PERIOD)
            self._greetings = 0
            for peer in [*self.peers.values()]:
                if now - peer.seen > peer.about.lease:
                    self._lose(peer)
            out += self._announcements()
        return out

    def _announcements(self) -> Iterator[Outgoing]:
        known = {peer.meta: peer for peer in self.peers.values() if peer.is_known}
        for address in dict.fromkeys((*self._searched, *known)):
            yield self._announce_to(address, bytes(wire.PREFIX))

    @property
    def is_told(self) -> bool:
        """True if each peer has told all of its endpoints."""
        told = all(self._readers[reader].is_complete for _, reader in discovery.SEDP.values())
        return told and all(peer.is_known for peer in self.peers.values())

    def remote_endpoints(self) -> Iterator[Endpoint]:
        """Yield the endpoints of all peers."""
        for peer in self.peers.values():
            yield from peer.endpoints.values()
