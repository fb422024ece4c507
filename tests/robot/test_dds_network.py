"""Participants of DDS on a simulated network: no sockets, no clock, and packets that get lost."""

import heapq
import itertools
import random
import re

import msgspec
import pytest

from idlc.robot.dds import discovery, formats, wire
from idlc.robot.dds.discovery import EndpointData
from idlc.robot.dds.graph import READER, WRITER, guid_of
from idlc.robot.dds.participant import MOST_ANNOUNCEMENTS, MOST_PEERS, Participant
from idlc.robot.dds.writer import Writer
from idlc.robot.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from tests.support.rounds import SEED, rounds

PORT = 7410
ALL = QoSProfile(history=HistoryPolicy.KEEP_ALL)
LATCHED = QoSProfile(depth=3, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BEST_EFFORT = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
TYPE = "std_msgs::msg::dds_::String_"


class Network:
    """Hosts with one participant each; `loss` is the part of the packets that never arrive."""

    def __init__(self, seed=0, loss=0.0, fragment=60_000):
        self.random = random.Random(seed)
        self.loss = loss
        self.fragment = fragment
        self.now = 1.0
        self.hosts = {}
        self.isolated = set()
        self.sent = []
        self._order = itertools.count()
        self._flying = []

    def add(self, number, name=0):
        """Start the participant of a host, in the place of the one that was there."""
        host = f"10.0.0.{number}"
        others = [(f"10.0.0.{other}", PORT) for other in range(1, 9) if other != number]
        prefix = wire.VENDOR + bytes([number]) * 8 + (name or number * 257).to_bytes(2, "big")
        own = Participant(prefix, [(host, PORT)], others, lambda _: self.fragment)
        self.hosts[host] = own
        return own

    def send(self, participant, packets):
        source = next(host for host, own in self.hosts.items() if own is participant)
        for target, prefix, parts in packets:
            head = (formats.for_participant(prefix),) if any(prefix) else ()
            packet = formats.format_packet(participant.prefix, (*head, *parts))
            self.sent.append((source, target, packet))
            copies = 0 if self.random.random() < self.loss else 1
            copies += self.loss > 0 and self.random.random() < 0.05
            for _ in range(copies):
                late = self.random.random() * 0.05 if self.loss else 0.001
                flight = (self.now + late, next(self._order), source, target[0], packet)
                heapq.heappush(self._flying, flight)

    def run(self, seconds):
        end = self.now + seconds
        while True:
            due = min(own.deadline for own in self.hosts.values())
            arrives = self._flying[0][0] if self._flying else end
            if min(due, arrives) >= end:
                self.now = end
                return
            self.now = max(self.now, min(due, arrives))
            if arrives <= due:
                _, _, source, target, packet = heapq.heappop(self._flying)
                if target in self.hosts and not {source, target} & self.isolated:
                    own = self.hosts[target]
                    self.send(own, own.receive(packet, (source, PORT), self.now))
            else:
                for own in [*self.hosts.values()]:
                    if own.deadline <= due:
                        self.send(own, own.tick(self.now))

    def writer(self, participant, qos, number=1, topic="rt/chatter"):
        end = EndpointData(guid_of(participant.prefix, number, WRITER), topic, TYPE, qos)
        participant.shared.now = self.now
        writer = participant.add_writer(end)
        self.send(participant, participant.shared.collect())
        return writer

    def reader(self, participant, qos, number=2, topic="rt/chatter"):
        received = []
        end = EndpointData(guid_of(participant.prefix, number, READER), topic, TYPE, qos)
        participant.shared.now = self.now
        reader = participant.add_reader(end, lambda sample: received.append(sample.payload))
        self.send(participant, participant.shared.collect())
        return reader, received

    def write(self, participant, writer, payload):
        participant.shared.now = self.now
        writer.write(payload)
        self.send(participant, participant.shared.collect())

    def remove(self, participant, end):
        participant.shared.now = self.now
        participant.remove(end.guid)
        self.send(participant, participant.shared.collect())

    def leave(self, participant):
        participant.leave()
        self.send(participant, participant.shared.collect())


def text(number, size=8):
    return b"\0\1\0\0" + number.to_bytes(4, "little") * (size // 4)


@pytest.mark.parametrize("loss", [0.0, 0.05, 0.2, 0.3])
@pytest.mark.parametrize("size", [8, 40_000])
def test_reliable_samples_arrive_in_order_and_complete(loss, size):
    for seed in range(rounds(4)):
        network = Network(SEED + seed, loss, fragment=1_344)
        left, right = network.add(1), network.add(2)
        writer = network.writer(left, ALL)
        reader, received = network.reader(right, ALL)
        network.run(20)
        assert writer.readers
        assert reader.writers
        count = 40 if size == 8 else 5
        for number in range(count):
            network.write(left, writer, text(number, size))
            network.run(0.01)
        network.run(60)
        assert received == [text(number, size) for number in range(count)]
        # nothing waits for anything
        assert left.shared.due == right.shared.due == {}
        assert [(each.early, each.partial, each.bytes) for each in reader.writers.values()] == [
            ({}, {}, 0)
        ]


def test_a_participant_ignores_its_own_packets_and_those_for_others():
    network = Network()
    left, right, other = (network.add(number) for number in (1, 2, 3))
    writer = network.writer(left, ALL)
    received = [network.reader(participant, ALL)[1] for participant in (right, other)]
    network.run(5)
    network.isolated = {"10.0.0.3"}
    known = len(network.sent)
    network.write(left, writer, text(1))
    network.run(0.01)
    assert received == [[text(1)], []]
    for source, target, packet in network.sent[known:]:
        if target[0] != "10.0.0.3":
            assert not other.receive(packet, (source, PORT), network.now)
    for source, _, packet in network.sent:
        if source == "10.0.0.1":
            assert not left.receive(packet, (source, PORT), network.now)
    assert received == [[text(1)], []]
    assert left.peers.keys() == {right.prefix, other.prefix}


@pytest.mark.parametrize("loss", [0.0, 0.2])
def test_late_readers_get_what_is_kept(loss):
    network = Network(SEED, loss)
    left = network.add(1)
    writer = network.writer(left, LATCHED)
    for number in range(10):
        network.write(left, writer, text(number))
    _, local = network.reader(left, LATCHED, 3)
    right = network.add(2)
    _, latched = network.reader(right, LATCHED)
    _, volatile = network.reader(right, QoSProfile(), 4)
    network.run(20)
    network.write(left, writer, text(10))
    network.run(5)
    assert latched == local == [text(number) for number in (7, 8, 9, 10)]
    assert volatile == [text(10)]


def test_ends_that_do_not_fit_are_not_connected():
    network = Network()
    left, right = network.add(1), network.add(2)
    writer = network.writer(left, BEST_EFFORT)
    _, reliable = network.reader(right, QoSProfile(), 2)
    _, best_effort = network.reader(right, BEST_EFFORT, 3)
    _, elsewhere = network.reader(right, BEST_EFFORT, 4, "rt/other")
    network.run(2)
    for number in range(3):
        network.write(left, writer, text(number))
    network.run(1)
    assert (reliable, elsewhere) == ([], [])
    assert best_effort == [text(number) for number in range(3)]


def test_participants_go_by_themselves_or_after_their_lease_and_return():
    network = Network()
    left, right = network.add(1), network.add(2)
    network.writer(right, LATCHED)
    _, received = network.reader(left, LATCHED)
    network.run(2)
    assert len([*left.remote_endpoints()]) == 1
    network.isolated.add("10.0.0.2")
    network.run(30)
    assert (left.peers, [*left.remote_endpoints()]) == ({}, [])
    network.isolated.clear()
    network.run(10)
    assert len([*left.remote_endpoints()]) == 1
    network.write(right, right._ends[b"\0\0\1" + WRITER], text(1))
    network.run(1)
    assert received == [text(1)]
    network.leave(right)
    del network.hosts["10.0.0.2"]
    network.run(1)
    assert left.peers == {}


def test_endpoints_that_come_and_go_leave_nothing():
    network = Network(SEED, 0.1)
    left, right = network.add(1), network.add(2)
    _, received = network.reader(right, ALL)
    for number in range(3, 400):
        writer = network.writer(left, ALL, number)
        network.run(0.02)
        network.remove(left, writer)
    network.run(30)
    assert [*right.remote_endpoints()] == []
    assert all(end.writers == {} for end in right._ends.values() if end.qos is ALL)
    assert sum(len(writer.history) for writer in left._announcers.values()) <= 300
    assert received == []


def test_late_readers_get_nothing_that_has_outlived_its_lifespan():
    network = Network()
    left, right = network.add(1), network.add(2)
    short = msgspec.structs.replace(LATCHED, lifespan=10**9)
    writer = network.writer(left, short)
    for number in range(3):
        network.write(left, writer, text(number))
        network.run(0.6)
    late = [network.reader(own, LATCHED, 5)[1] for own in (left, right)]
    network.run(5)
    later = [network.reader(own, LATCHED, 6)[1] for own in (left, right)]
    network.write(left, writer, text(3))
    network.run(1)
    assert late == [[text(2), text(3)]] * 2
    assert later == [[text(3)]] * 2


def announcement(prefix, host="10.0.0.2"):
    """Return a packet by which a participant announces itself."""
    network = Network()
    own = Participant(prefix, [(host, PORT)], [("10.0.0.1", PORT)], lambda _: 1000)
    (packet,) = own.tick(1.0)
    network.hosts["10.0.0.9"] = own
    network.send(own, [packet])
    return network.sent[0][2]


def test_strangers_get_three_announcements_where_their_packets_come_from():
    network = Network()
    own = network.add(1)
    network.writer(own, LATCHED)
    own.tick(0.5)
    packet = announcement(wire.VENDOR + b"x" * 10, "203.0.113.7")
    answers = [own.receive(packet, ("10.0.0.2", 5), 1.0 + n) for n in range(50)]
    packets = [packet for each in answers for packet in each]
    assert [packet.address for packet in packets] == [("10.0.0.2", PORT)] * MOST_ANNOUNCEMENTS
    # many names are many strangers, but not for ever
    drawn = 0
    for number in range(3000):
        stranger = announcement(wire.VENDOR + number.to_bytes(10, "big"))
        drawn += len(own.receive(stranger, ("10.0.0.2", 5), 2.0))
    assert drawn <= MOST_PEERS
    assert len(own.peers) <= MOST_PEERS
    assert not any(peer.endpoints for peer in own.peers.values())


@pytest.mark.parametrize("qos", [QoSProfile(depth=3), LATCHED], ids=["volatile", "latched"])
def test_a_reader_of_cyclone_dds_gets_samples_after_its_first_answer(qos):
    """A volatile reader skips the samples that the first heartbeat announces."""
    shared = formats.Shared(lambda _: 60_000)
    writer = Writer(wire.VENDOR + bytes(10) + b"\0\0\1\3", LATCHED, shared)
    guid = b"\x01\x10" + bytes(10) + b"\0\0\2\4"

    def sent():
        packet = itertools.chain(*(outgoing.parts for outgoing in shared.collect()))
        for _, part in wire.parse_packet(formats.format_packet(bytes(12), packet)).parts:
            if isinstance(part, wire.Gap):
                yield part.first, *part.others
            else:
                yield part.number if isinstance(part, wire.Data) else (part.first, part.last)

    def answer(base, beat):
        writer.receive(guid, wire.AckNack(guid[12:], writer.id, base, (), beat))
        return [*sent()]

    writer.write(text(1))
    writer.match(guid, ("10.0.0.1", PORT), qos)
    if qos is LATCHED:
        assert [*sent()] == [(1, 1)]
        writer.write(text(2))
        assert [*sent()] == [2, (1, 2)]
        return
    assert [*sent()] == [(2, 1)]
    writer.write(text(2))
    assert [*sent()] == []
    assert answer(1, 0) == [(2, 1)]  # its question after the match
    for number in range(3, 7):
        writer.write(text(number))
    assert answer(2, 1) == [4, 5, 6, (2, 3), (4, 6)]
    writer.write(text(7))
    assert [*sent()] == [7, (5, 7)]


def test_the_ends_of_a_client_have_one_name():
    for half, other, role in (("rq/a", "rr/a", b"clientid"), ("rr/a", "rq/a", b"serviceid")):
        ends = [(half, WRITER), (other, READER)]
        guids = [(guid_of(wire.VENDOR + bytes(10), 7, kind), topic) for topic, kind in ends]
        announced = [
            discovery.format_endpoint(EndpointData(guid, topic, TYPE, ALL)) for guid, topic in guids
        ]
        (names,) = {re.findall(b"(?:client|service)id=[0-9a-f]+;", data)[0] for data in announced}
        assert names.startswith(role)
