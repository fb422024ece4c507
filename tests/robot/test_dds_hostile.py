"""Packets from anybody: they are read or ignored, end in time, and take up bounded memory."""

import random
import struct
import time
from collections import Counter, OrderedDict

import pytest

from idlc.robot.dds import formats, graph, wire
from idlc.robot.dds.discovery import EndpointData
from idlc.robot.dds.formats import MOST_WAITING
from idlc.robot.dds.graph import RemoteNodes
from idlc.robot.dds.participant import MOST_ANNOUNCEMENTS, MOST_PEERS
from idlc.robot.dds.reader import Reader
from idlc.robot.dds.writer import Writer
from tests.robot.test_dds_network import ALL, LATCHED, PORT, TYPE, Network, text
from tests.support.rounds import SEED, rounds

#: A head, from a participant that a test makes known.
SOURCE = wire.VENDOR + b"\2" * 10
HEAD = b"RTPS\2\3" + SOURCE[:2] + SOURCE


def conversation():
    """Return a network after some exchange, and the packets to its first participant."""
    network = Network(SEED, 0.1, fragment=1_344)
    left, right = network.add(1), network.add(2)
    writers = [(own, network.writer(own, LATCHED)) for own in (left, right)]
    for own in (left, right):
        network.reader(own, LATCHED)
        network.reader(own, ALL, 3)
    network.run(3)
    for number in range(20):
        for own, writer in writers:
            network.write(own, writer, text(number, 8 if number % 4 else 20_000))
        network.run(0.2)
    return network, [packet for _, target, packet in network.sent if target[0] == "10.0.0.1"]


def mutated(rng, packet, others):
    data = bytearray(packet)
    for _ in range(rng.randrange(1, 5)):
        at = rng.randrange(20, len(data)) if len(data) > 20 else 0
        kind = rng.randrange(6)
        if kind == 0:
            data[at] = rng.choice([0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)])
        elif kind == 1:
            data[at : at + 4] = struct.pack("<I", rng.choice([0, 1, 2**31 - 1, 2**32 - 1, 256]))
        elif kind == 2:
            del data[at : at + rng.randrange(1, 9)]
        elif kind == 3:
            other = rng.choice(others)
            data[at:] = other[at:]
        elif kind == 4:
            data[at:at] = data[20 : 20 + rng.randrange(1, 80)]
        else:
            data[at + 1 : at + 2] = bytes([rng.randrange(256)])
    return bytes(data)


def memory(participant):
    """Return the number of things that a participant keeps."""
    readers = [end for end in participant._ends.values() if isinstance(end, Reader)]
    writers = [writer for reader in readers for writer in reader.writers.values()]
    waiting = sum(len(each.early) + len(each.partial) for each in writers)
    ends = sum(len(peer.endpoints) for peer in participant.peers.values())
    return len(participant.peers) + len(writers) + waiting + ends


@pytest.mark.rounds
def test_mutated_packets_raise_nothing_and_leave_little():
    """From a peer, and from a host that never received anything; IDLC_ROUNDS=100 is 10**7."""
    rng = random.Random(SEED)
    network, packets = conversation()
    own, slowest, drawn = network.hosts["10.0.0.1"], 0.0, Counter()
    for number in range(rounds(100_000)):
        packet = mutated(rng, rng.choice(packets), packets)
        host = rng.choice(["10.0.0.2", "10.0.0.99"])
        if host == "10.0.0.99":  # it knows no name of this participant
            packet = packet.replace(own.prefix, bytes(12))
        before = time.process_time()
        answers = own.receive(packet, (host, 7410), network.now)
        slowest = max(slowest, time.process_time() - before)
        # nothing goes to an address from which nothing came
        assert {answer.address[0] for answer in answers} <= {"10.0.0.2", "10.0.0.99"}
        drawn += Counter(each.prefix for each in answers if each.address[0] == "10.0.0.99")
        assert sum(len(part) for each in answers for part in each.parts) < 10_000_000
        if number % 100 == 0:
            own.tick(network.now)
            network.now += 0.1
    assert slowest < 5
    assert memory(own) < 3000
    assert own.shared._used.total() < 10_000_000
    assert 0 < max(drawn.values()) <= MOST_ANNOUNCEMENTS


def test_what_a_peer_draws_and_keeps_is_bounded():
    network, _ = conversation()
    own = network.hosts["10.0.0.1"]
    head = HEAD + formats.for_participant(own.prefix)
    writer = next(
        end for end in own._ends.values() if end.qos is LATCHED and hasattr(end, "history")
    )
    reader = next(iter(writer.readers.values()))
    # it asks for all large samples, in all packets
    for _ in range(40):
        network.write(own, writer, text(7, 2_000_000))
    missing = [*range(max(1, writer.last - 200), writer.last + 1)]
    drawn = 0
    for count in range(1000, 1400):
        question = formats.format_acknack(reader.id, writer.id, 1, [], count, is_final=False)
        ask = formats.format_acknack(
            reader.id, writer.id, missing[0], missing, count + 1000, is_final=False
        )
        pieces = formats.format_nack_fragment(
            reader.id, writer.id, writer.last, [*range(1, 257)], count
        )
        answers = own.receive(head + question + ask + pieces, ("10.0.0.2", PORT), network.now)
        drawn += sum(len(each) for answer in answers for each in answer.parts)
    assert 1_000_000 < drawn < 10_000_000
    # and with one packet, for all small samples many times
    for number in range(200):
        network.write(own, writer, text(number))
    network.now += 60
    asks = [
        formats.format_acknack(
            reader.id, writer.id, writer.last - 2, [*range(writer.last - 2, writer.last + 1)],
            count, is_final=False,
        )
        for count in range(2000, 3300)
    ]  # fmt: skip
    answers = own.receive(head + b"".join(asks), ("10.0.0.2", PORT), network.now)
    assert 0 < len(answers) < 5000
    # it sends the second half of everything
    far = next(end for end in own._ends.values() if end.qos is ALL and hasattr(end, "writers"))
    theirs = next(iter(far.writers.values()))
    for number in range(theirs.next + 1, theirs.next + 4_000):
        data = formats.format_data(far.id, theirs.id, number, b"", bytes(60_000))
        own.receive(head + data, ("10.0.0.2", PORT), network.now)
    for first in range(1, 1000):
        data = formats.format_fragment(far.id, theirs.id, 9, b"", bytes(60_000), first, 40)
        own.receive(head + data, ("10.0.0.2", PORT), network.now)
    assert 10_000_000 < own.shared._used.total() <= MOST_WAITING // 2
    # and when it goes, all of that goes
    network.hosts.pop("10.0.0.2")
    network.run(60)
    assert own.peers == {}
    assert own.shared._used == {}


def part(kind, body, flags=1):
    return struct.pack("<BBH", kind, flags, len(body)) + body


BIG = struct.pack("<iI", 2**31 - 1, 2**32 - 1)
ONE = struct.pack("<iI", 0, 1)
IDS = b"\0\0\2\4\0\0\1\3"
DATA, FRAGMENT = b"\0\0\x10\0" + IDS + ONE, b"\0\0\x1c\0" + IDS + ONE
MOST = 2**32 - 1


def words(*numbers):
    return struct.pack(f"<{len(numbers)}I", *numbers)


EXTREMES = {
    "many bits": part(6, IDS + ONE + words(MOST)),
    "bits beyond the end": part(6, IDS + ONE + words(256)),
    "a question for everything": part(6, IDS + BIG + words(256, *[MOST] * 9)),
    "a heartbeat of all numbers": part(7, IDS + ONE + BIG + words(1)),
    "a heartbeat backwards": part(7, IDS + BIG + ONE + words(2)),
    "a gap over all": part(8, IDS + ONE + BIG + words(0)),
    "a large sample": part(0x16, FRAGMENT + struct.pack("<IHHI", 1, 1, 4, MOST) + b"abcd"),
    "fragments of nothing": part(0x16, FRAGMENT + struct.pack("<IHHI", 1, 1, 0, 0)),
    "fragments beyond the end": part(0x16, FRAGMENT + struct.pack("<IHHI", MOST, 9, 4, 8)),
    "missing fragments": part(0x12, IDS + ONE + words(MOST, MOST)),
    "parameters without an end": part(0x15, DATA + b"\2\0\0\0" * 2000, 7),
    "a parameter beyond the end": part(0x15, DATA + b"\2\0\xff\xff", 7),
    "an offset beyond the end": part(0x15, b"\0\0\xff\xff" + IDS + ONE, 5),
    "no content": part(0x15, b"", 5),
    "a length beyond the end": b"\x15\x05\xff\xff",
    "no length": b"\x15\x05\0\0",
    "a source": part(0x0C, bytes(20)) + part(7, IDS + ONE + ONE + ONE),
}


@pytest.mark.parametrize("order", ["alone", "after a destination"])
@pytest.mark.parametrize("case", EXTREMES)
def test_extremes_are_refused_at_once(case, order):
    network = Network()
    own, _ = network.add(1), network.add(2)
    network.writer(own, LATCHED)
    network.reader(own, ALL)
    network.run(2)
    before = memory(own)
    head = formats.for_participant(own.prefix) if order != "alone" else b""
    begun = time.process_time()
    for _ in range(50):
        answers = own.receive(HEAD + head + EXTREMES[case], ("10.0.0.2", 7410), network.now)
        assert sum(len(each) for answer in answers for each in answer.parts) < 1000
    assert time.process_time() - begun < 5
    assert memory(own) <= before + MOST_PEERS


@pytest.mark.parametrize("order", [b"\0\1", b"\0\0"])
def test_requests_of_cyclone_dds_are_read_as_they_were_written_or_ignored(order):
    inline = formats.format_related(b"a name of 16 byt", 2**40)
    body = order + b"\0\0" + b"body"
    sent = formats.wrap(body, inline)
    for end in range(len(sent) + 1):
        sample = wire.Data(b"", b"\1\x10" + bytes(14), 1, wire.NONE, sent[:end], False, 0)
        payload, named = formats.unwrap(sample, b"a name o")
        assert (named is None) == (end < 20)
        assert named in (None, (b"a name of 16 byt", 2**40))
    assert payload == body


def test_many_heartbeats_draw_one_answer_at_a_time():
    network, _ = conversation()
    own = network.hosts["10.0.0.1"]
    reader = next(end for end in own._ends.values() if end.qos is ALL and hasattr(end, "writers"))
    (theirs,) = reader.writers.values()
    beats = [
        formats.format_heartbeat(reader.id, theirs.id, theirs.next, theirs.next + 9, count)
        for count in range(1000, 3000)
    ]
    head = HEAD + formats.for_participant(own.prefix)
    answers = own.receive(head + b"".join(beats), ("10.0.0.2", PORT), network.now)
    assert len(answers) == 1
    assert len(own.tick(network.now + 0.02)) in (1, 2)


class Unread(OrderedDict):
    """A history that nobody may read from end to end."""

    def items(self):
        raise AssertionError


def test_an_answer_costs_the_same_however_long_the_history_is():
    """A silent reader of Cyclone DDS gets 256 samples at its first answer, and asks for more."""
    shared = formats.Shared(lambda _: 60_000)
    writer = Writer(HEAD[8:] + b"\0\0\1\3", ALL, shared)
    writer.history = Unread()
    guid = b"\x01\x10" + bytes(10) + b"\0\0\2\4"
    writer.match(guid, ("10.0.0.2", PORT), ALL)
    for number in range(2000):
        writer.write(text(number))
    assert len(shared.collect()) == 1
    for base, beat in ((2**62, 1), (0, 1), (1, 0), (1, 0)):
        writer.receive(guid, wire.AckNack(guid[12:], writer.id, base, (), beat))
        assert sum(map(len, shared.collect())) < 10
    writer.receive(guid, wire.AckNack(guid[12:], writer.id, 1, (), 2))
    assert len(shared.collect()) == 256 + 1


def test_nodes_and_topics_with_other_names_than_those_of_ros_are_not_shown():
    topics = ("rt/a", "rt/\x1b[2J", "rt/a%b", "rt/a/", "rt/", "a", "rt//a")
    ends = [
        EndpointData(SOURCE + bytes([0, 0, number, 3]), topic, TYPE, ALL)
        for number, topic in enumerate(topics)
    ]
    names = (("/", "a"), ("/a%b", "c"), ("/", "a%b"), ("", "b\n"))
    nodes = [graph.NodeInfo(*each, (), ()) for each in names]
    remote = RemoteNodes(0)
    payload = graph.format_info(SOURCE, nodes)
    assert remote.learn(wire.Data(b"", SOURCE + bytes(4), 1, wire.NONE, payload, False, 0))
    shown = [*remote.entities([SOURCE], ends, {})]
    assert [(entity.node, entity.name) for entity in shown] == [
        ("a", ""), ("_NODE_NAME_UNKNOWN_", "/a"),
    ]  # fmt: skip


def test_what_participants_tell_of_nodes_is_bounded():
    remote = RemoteNodes(0)
    nodes = [graph.NodeInfo("/", "a", (bytes(16),) * 4000, ()) for _ in range(10)]
    payload = graph.format_info(SOURCE, nodes)
    taken = 0
    for number in range(10):
        name = bytes([number]) * 12
        told = payload[:4] + name + payload[16:]
        for _ in range(2):
            taken += remote.learn(wire.Data(b"", name + bytes(4), 1, wire.NONE, told, False, 0))
    assert taken == 2
    with pytest.raises(wire.WireError):
        graph.parse_info(bytes(2_000_000))
    with pytest.raises(wire.WireError, match="too large"):
        graph.parse_info(graph.format_info(SOURCE, nodes * 2))


def test_other_packets_than_rtps_are_counted():
    own = Network().add(1)
    for packet in (b"", b"RTPS", b"x" * 100, b"RTPS\1\0" + bytes(14), HEAD[:19]):
        assert own.receive(packet, ("10.0.0.2", 1), 1.0) == []
    assert own.malformed == 5


NODES = [graph.NodeInfo("/ns", "talker", (b"r" * 16,), (b"w" * 16, b"x" * 16))]


def test_nodes_are_read_as_they_were_written_and_cut_off_ones_are_refused():
    payload = graph.format_info(b"p" * 12, NODES)
    assert graph.parse_info(payload) == (b"p" * 12 + b"\0\0\1\xc1", tuple(NODES))
    for end in range(len(payload) - 4):
        with pytest.raises(wire.WireError):
            graph.parse_info(payload[:end])
    with pytest.raises(wire.WireError):
        graph.parse_info(payload[:20] + b"\xff\xff\xff\xff" + payload[24:])


@pytest.mark.parametrize(("size", "is_read"), [(511, True), (512, False), (1_000_000, False)])
def test_long_names_of_nodes_are_refused(size, is_read):
    """They are keys of caches, which hold 16,384 of them; a zero ends each."""
    payload = graph.format_info(b"p" * 12, [NODES[0]._replace(name="n" * size)])
    if is_read:
        assert graph.parse_info(payload)[1][0].name == "n" * size
    else:
        with pytest.raises(wire.WireError):
            graph.parse_info(payload)


def test_the_ids_of_humble_have_24_bytes():
    def gid(letter):
        return letter * 16 + bytes(8)

    payload = b"\0\1\0\0" + gid(b"p") + struct.pack("<I", 1) + struct.pack("<I", 4) + b"/ns\0"
    payload += struct.pack("<I", 7) + b"talker\0\0" + struct.pack("<I", 1) + gid(b"r")
    payload += struct.pack("<I", 2) + gid(b"w") + gid(b"x")
    assert graph.parse_info(payload) == (b"p" * 16, tuple(NODES))
