"""A participant: it meets others, learns of their endpoints, and matches them with its own.

It has no sockets and no clock: `receive` takes a packet, its source and the time, and returns the
packets to send; `deadline` is when `tick` has something to do. A stranger, who has not yet named
this participant in a packet, gets at most three announcements. All packets to a peer go to the
IP address that its own packets came from, as an announced one may belong to somebody else.
"""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Callable, Iterable, Iterator

from idlc.robot.dds import discovery, formats, wire
from idlc.robot.dds.discovery import EndpointData, Peer, fits
from idlc.robot.dds.formats import Address, Outgoing, Remote, Shared
from idlc.robot.dds.reader import Reader
from idlc.robot.dds.writer import Writer

#: Participants, the announcements that a stranger gets, and the endpoints of one and of all.
MOST_PEERS = 256
MOST_ANNOUNCEMENTS = 3
#: Announcements to strangers between two of the periodic ones, whatever names they use.
MOST_GREETINGS = 256
_MOST_GREETED = 4096
MOST_ENDPOINTS, MOST_OF_ALL = 4096, 2**15
#: Ends of own endpoints that late participants are still told of.
_ENDS = 256
#: Seconds between announcements: the first ones come fast.
_PERIODS = (0.1, 0.2, 0.4, 0.8, 1.6)
_PERIOD = 3.0
#: Seconds of silence after which a peer may go on at another IP address.
_SILENCE = 10.0


class Participant:
    """The endpoints of this program, and what it knows of others.

    `searched` are the addresses where others may listen. `fragment` returns the most bytes of a
    fragment for a host. `changed` is called after each change of the remote endpoints. Methods add
    packets to those that `shared.collect` returns, and begin at the time `shared.now`.
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
        self.shared = Shared(fragment)
        self.peers: dict[bytes, Peer] = {}
        #: Strangers beyond the limit, participants that offer no UDP, and malformed packets.
        self.refused = self.without_udp = self.malformed = 0
        self._addresses: list[Address] = []
        #: The announcement, and its number, as others ignore one that they know.
        self._announcement, self._edition = b"", 0
        self._searched = [*searched]
        self._changed = changed
        #: The own ends by their ids, and what was announced of them by their GUIDs.
        self._ends: dict[bytes, Writer | Reader] = {}
        self._local: dict[bytes, tuple[EndpointData, int]] = {}
        self._removed: deque[tuple[Writer, int]] = deque()
        self._periods = iter(_PERIODS)
        self._announce_at = 0.0
        #: The announcements that strangers got, those that are gone included, and their number
        #: since the last periodic one.
        self._greeted: OrderedDict[bytes, int] = OrderedDict()
        self._greetings = 0
        self._announcers: dict[bool, Writer] = {}
        self._learners: dict[bool, Reader] = {}
        for is_writer, ids in discovery.SEDP.items():
            guids = [prefix + each for each in ids]
            announcer = Writer(guids[0], discovery.SEDP_QOS, self.shared)
            learner = Reader(
                guids[1], discovery.SEDP_QOS, self._learn, self.shared, remembers=False
            )
            self._ends |= {announcer.id: announcer, learner.id: learner}
            self._announcers[is_writer], self._learners[is_writer] = announcer, learner
        self.move([*addresses])

    # own endpoints

    def add_writer(self, end: EndpointData) -> Writer:
        """Announce a writer."""
        writer = Writer(end.guid, end.qos, self.shared)
        self._add(end, writer)
        return writer

    def add_reader(self, end: EndpointData, deliver: Callable[[wire.Data], None]) -> Reader:
        """Announce a reader."""
        reader = Reader(end.guid, end.qos, deliver, self.shared)
        self._add(end, reader)
        return reader

    def _add(self, end: EndpointData, own: Writer | Reader) -> None:
        self._ends[own.id] = own
        announcer = self._announcers[end.is_writer]
        announcer.write(discovery.format_endpoint(end))
        for other, _ in self._local.values():
            near = self._ends[other.id]
            writer, reader = (own, near) if end.is_writer else (near, own)
            if fits(end, other) and isinstance(writer, Writer) and isinstance(reader, Reader):
                writer.match_local(reader)
        self._local[end.guid] = end, announcer.last
        for peer in self.peers.values():
            for other in peer.endpoints.values():
                self._match(end, other, peer)

    def remove(self, guid: bytes) -> None:
        """Withdraw an endpoint; a second time does nothing."""
        if guid not in self._local:
            return
        end, number = self._local.pop(guid)
        own = self._ends.pop(end.id)
        own.close()
        for writer in self._ends.values():
            if isinstance(writer, Writer):
                writer.local = [reader for reader in writer.local if reader is not own]
        announcer = self._announcers[end.is_writer]
        announcer.forget(number)
        announcer.write(b"", discovery.format_end(guid))
        self._removed.append((announcer, announcer.last))
        if len(self._removed) > _ENDS:
            announcer, number = self._removed.popleft()
            announcer.forget(number)

    def leave(self) -> None:
        """Tell all that this participant ends."""
        end = discovery.format_end(self.prefix + discovery.PARTICIPANT_ID)
        for peer in self.peers.values():
            self._announce(peer.meta, ended=end)

    def move(self, addresses: list[Address]) -> bool:
        """Announce these addresses of this participant from now on; return whether they are new."""
        if addresses == self._addresses:
            return False
        self._addresses, self._announce_at = addresses, 0.0
        self._announcement = discovery.format_participant(self.prefix, addresses)
        self._edition += 1
        return True

    def _match(self, own: EndpointData, other: EndpointData, peer: Peer) -> None:
        """Connect two ends if they fit."""
        if fits(own, other):
            self._ends[own.id].match(other.guid, peer.address(other), other.qos)

    def _learn(self, sample: wire.Data) -> None:
        """Take an announcement of an endpoint."""
        peer = self.peers.get(sample.writer[: wire.PREFIX])
        if peer is None:
            return
        if (guid := discovery.ended(sample)) is not None:
            if peer.endpoints.pop(guid, None):
                self._unmatch(guid)
                self._changed()
            return
        try:
            end = discovery.parse_endpoint(sample.payload)
        except ValueError:
            self.malformed += 1
            return
        has_room = end.guid in peer.endpoints or (
            len(peer.endpoints) < MOST_ENDPOINTS
            and sum(len(each.endpoints) for each in self.peers.values()) < MOST_OF_ALL
        )
        if end.guid[: wire.PREFIX] != peer.prefix or not has_room:
            self.refused += 1
            return
        peer.endpoints[end.guid] = end
        for own, _ in [*self._local.values()]:
            self._match(own, end, peer)
        self._changed()

    def _unmatch(self, guid: bytes) -> None:
        for end in self._ends.values():
            end.unmatch(guid)

    # others

    def _meet(self, part: wire.Data, host: str) -> None:
        """Take an announcement of a participant."""
        if (guid := discovery.ended(part)) is not None:
            peer = self.peers.get(guid[: wire.PREFIX])
            if peer is not None and peer.host == host:
                self._lose(peer)
            return
        try:
            about = discovery.parse_participant(part.payload)
        except wire.WireError:
            self.malformed += 1
            return
        if about.prefix == self.prefix:
            return
        if not about.meta_port:
            self.without_udp += 1
            return
        now, peer = self.shared.now, self.peers.get(about.prefix)
        if peer is not None and peer.host != host and now - peer.seen > _SILENCE:
            self._lose(peer)
            peer = None
        if peer is None:
            if len(self.peers) >= MOST_PEERS:
                strangers = (each for each in self.peers.values() if not each.is_known)
                oldest = next(strangers, None)
                if oldest is None:
                    self.refused += 1
                    return
                del self.peers[oldest.prefix]
            peer = self.peers[about.prefix] = Peer(about, host, now)
        if peer.host == host:
            peer.about = about._replace(meta_port=peer.about.meta_port) if peer.is_known else about
            peer.seen = now
            self._greet(peer)

    def _greet(self, peer: Peer) -> None:
        """Announce this participant to one that does not know it yet, not for ever."""
        count = self._greeted.get(peer.prefix, 0)
        if peer.is_known or count >= MOST_ANNOUNCEMENTS or self._greetings >= MOST_GREETINGS:
            return
        self._greeted[peer.prefix] = count + 1
        if len(self._greeted) > _MOST_GREETED:
            self._greeted.popitem(last=False)
        self._greetings += 1
        self._announce(peer.meta, peer.prefix)

    def _announce(self, address: Address, prefix: bytes = wire.ALL, ended: bytes = b"") -> None:
        """Send a sample about this participant, or about its end."""
        ids = discovery.SPDP_READER, discovery.SPDP_WRITER
        number, payload = self._edition, self._announcement
        if ended:
            number, payload = number + 1, b""
        part = formats.format_data(*ids, number, ended, payload)
        self.shared.send(Remote(prefix + ids[0], address, False), part)

    def _know(self, peer: Peer) -> None:
        """Exchange endpoints with a peer that has named this participant."""
        peer.is_known = True
        self._greeted.pop(peer.prefix, None)
        for writer, reader in discovery.SEDP.values():
            self._ends[writer].match(peer.prefix + reader, peer.meta, discovery.SEDP_QOS)
            self._ends[reader].match(peer.prefix + writer, peer.meta, discovery.SEDP_QOS)

    def _lose(self, peer: Peer) -> None:
        """Forget a peer and all of it."""
        del self.peers[peer.prefix]
        ids = (each for pair in discovery.SEDP.values() for each in pair)
        for guid in (*peer.endpoints, *(peer.prefix + each for each in ids)):
            self._unmatch(guid)
        if peer.endpoints:
            self._changed()

    # packets and time

    def receive(self, packet: bytes, source: Address, now: float) -> list[Outgoing]:
        """Take a packet; return the packets to send."""
        self.shared.now = now
        try:
            prefix, _vendor, parts = wire.parse_packet(packet)
        except wire.WireError:
            self.malformed += 1
            return []
        peer = self.peers.get(prefix)
        for destination, part in parts:
            if prefix == self.prefix or destination not in (self.prefix, wire.ALL):
                continue
            if isinstance(part, wire.Data) and part.writer == discovery.SPDP_WRITER:
                self._meet(part, source[0])
                peer = self.peers.get(prefix)
            if peer is None:
                continue
            is_same_host = peer.host == source[0]
            if not peer.is_known:
                if destination == wire.ALL or not is_same_host:
                    continue
                self._know(peer)
            peer.seen = now if is_same_host else peer.seen
            self._pass(prefix, part)
        return self.shared.collect()

    def _pass(self, prefix: bytes, part: wire.Submessage) -> None:
        """Pass a part on to the end that it is for; without a reader, to all of its writer."""
        if isinstance(part, (wire.AckNack, wire.NackFragment)):
            writer, guid = self._ends.get(part.writer), prefix + part.reader
            if isinstance(writer, Writer):
                writer.receive(guid, part)
            return
        guid = prefix + part.writer
        for reader in [*self.shared.matched.get(guid, ())]:
            if part.reader in (reader.id, wire.ALL_READERS):
                reader.receive(guid, part)

    @property
    def deadline(self) -> float:
        """When `tick` has something to do."""
        return min([self._announce_at, *self.shared.due.values()])

    def tick(self, now: float) -> list[Outgoing]:
        """Do what is due; return the packets to send."""
        self.shared.now = now
        self.shared.tick()
        if now >= self._announce_at:
            self._announce_at = now + next(self._periods, _PERIOD)
            self._greetings = 0
            for peer in [*self.peers.values()]:
                if now - peer.seen > peer.about.lease:
                    self._lose(peer)
            # a stranger at a searched address is named there, as it may have missed what named it
            names = {peer.meta: peer.prefix for peer in self.peers.values() if not peer.is_known}
            known = [peer.meta for peer in self.peers.values() if peer.is_known]
            for address in dict.fromkeys((*self._searched, *known)):
                self._announce(address, names.get(address, wire.ALL))
        return self.shared.collect()

    @property
    def is_told(self) -> bool:
        """True if each peer has told all of its endpoints."""
        told = all(learner.is_complete for learner in self._learners.values())
        return told and all(peer.is_known for peer in self.peers.values())

    def remote_endpoints(self) -> Iterator[EndpointData]:
        """Yield the endpoints of all peers."""
        for peer in self.peers.values():
            yield from peer.endpoints.values()
