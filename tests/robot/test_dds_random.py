"""Participants of DDS on a network that loses, repeats, delays, parts and restarts what it will."""

from itertools import pairwise

import pytest

from idlc.robot.dds.reader import Reader
from idlc.robot.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from tests.robot.test_dds_network import ALL, Network, text
from tests.support.examples import given, settings, st
from tests.support.rounds import ALL as WHOLE
from tests.support.rounds import SEED, rounds

EVERYTHING = QoSProfile(history=HistoryPolicy.KEEP_ALL, durability=DurabilityPolicy.TRANSIENT_LOCAL)
FAST = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.BEST_EFFORT)
HOSTS = ("10.0.0.1", "10.0.0.2", "10.0.0.3")
EVENTS = st.one_of(
    st.tuples(st.just("write"), st.integers(1, 20)),
    st.tuples(st.just("run"), st.sampled_from([0.02, 0.5, 5.0, 30.0])),
    st.tuples(st.just("part"), st.sampled_from(HOSTS)),
    st.tuples(st.just("heal"), st.none()),
    st.tuples(st.just("restart"), st.sampled_from(HOSTS[1:])),
    st.tuples(st.just("join"), st.sampled_from(HOSTS[1:])),
)


class Story:
    """One writer of everything, and readers that come and go."""

    def __init__(self, seed, loss):
        self.network = Network(seed, loss, fragment=1_344)
        self.writer = self.network.writer(self.network.add(1), EVERYTHING)
        self.written = []
        #: What readers of all, of what is new, and of what arrives received.
        self.complete, self.later, self.fast = [], [], []
        self.names = iter(range(2, 1000))
        for host in HOSTS[1:]:
            self.start(host)

    def start(self, host):
        self.network.add(int(host[-1]), next(self.names))
        self.join(host)

    def join(self, host):
        own = self.network.hosts[host]
        for qos, readers in ((EVERYTHING, self.complete), (ALL, self.later), (FAST, self.fast)):
            readers.append((own, self.network.reader(own, qos, next(self.names))[1]))

    def run(self, event, argument):
        network = self.network
        if event == "write":
            for _ in range(argument):
                number = len(self.written)
                self.written.append(text(number, 8 if number % 7 else 4_000))
                network.write(network.hosts[HOSTS[0]], self.writer, self.written[-1])
        elif event == "run":
            network.run(argument)
        elif event == "part":
            network.isolated.add(argument)
        elif event == "heal":
            network.isolated.clear()
        elif event == "restart":
            self.start(argument)
        else:
            self.join(argument)

    def alive(self, readers):
        return [received for own, received in readers if own in self.network.hosts.values()]


@pytest.mark.rounds
@settings(max_examples=rounds(200))
@given(st.lists(EVENTS, max_size=12), st.integers(0, 2**32), st.sampled_from([0, 0.05, 0.3]))
def test_reliable_topics_are_complete_and_in_order_after_all(events, seed, loss):
    story = Story(seed, loss)
    for event in (*events, ("write", 3), ("heal", None), ("run", 90.0)):
        story.run(*event)
    written = story.written
    assert all(received == written for received in story.alive(story.complete))
    for received in story.alive([*story.later, *story.fast]):
        numbers = [written.index(payload) for payload in received]
        assert all(before < after for before, after in pairwise(numbers))
    # nothing waits for anything any more
    for own in story.network.hosts.values():
        for reader in (end for end in own._ends.values() if isinstance(end, Reader)):
            if reader.reliable:
                assert [(w.early, w.partial, w.bytes) for w in reader.writers.values()] == [
                    ({}, {}, 0) for _ in reader.writers
                ]


@pytest.mark.rounds
def test_a_million_messages_and_a_day_leave_nothing():
    """Of both, `make test` does a part."""
    messages, seconds = (10**6, 24 * 3600) if WHOLE else (10_000, 600)
    network = Network(SEED, 0.0)
    left, right = network.add(1), network.add(2)
    writer = network.writer(left, QoSProfile(depth=100))
    reader, received = network.reader(right, QoSProfile())
    network.run(2)
    total = messages // 100
    for _ in range(100):
        for number in range(total):
            network.write(left, writer, text(number))
            if number % 50 == 0:
                network.run(0.01)
        network.run(seconds / 100)
        network.sent.clear()
        assert len(received) == total
        received.clear()
        assert len(writer.history) <= 100
        assert [each.early for each in reader.writers.values()] == [{}]
        assert len(network._flying) < 1000
    assert len(left.peers) == len(right.peers) == 1
    assert sum(len(each.history) for each in left._announcers.values()) == 1
