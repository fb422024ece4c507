"""MCAP files that writers put together in every way that the format allows, and in some others.

What is read in a window is what the mcap library reads record after record, without what lies
outside of the window; or an error, where the file contradicts itself.
"""

import os
import random
import zlib
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from io import FileIO
from struct import pack

import pytest
from mcap.records import Message
from mcap.stream_reader import StreamReader

import idlc
from idlc.recordings.containers import source
from idlc.recordings.containers.container import open_recording
from idlc.recordings.containers.messages import Window
from idlc.recordings.containers.source import RecordingError
from tests.support.mcap_mutations import COMPRESS, MAGIC
from tests.support.rounds import SEED, rounds

TOPICS = {1: "/a", 2: "/b", 3: "/a"}


def text(words):
    return pack("<I", len(words)) + words


def record(op, content):
    return pack("<BQ", op, len(content)) + content


SCHEMA = record(
    3, pack("<H", 1) + b"".join(map(text, (b"std_msgs/msg/Int8", b"ros2msg", b"int8 data")))
)
DEFINED = SCHEMA + b"".join(
    record(4, pack("<HH", number, 1) + text(name.encode()) + text(b"cdr") + text(b""))
    for number, name in TOPICS.items()
)


class File:
    """A file that is put together at random, and what its summary says of it."""

    def __init__(self, rng):
        self.rng = rng
        self.data = MAGIC + record(1, text(b"ros2") + text(b"test"))
        self.counts = dict.fromkeys(TOPICS, 0)
        self.times = []
        self.chunk_indexes = []
        self.repeats = rng.random() < 0.5
        self.time = 1000
        self.lies = False
        self.has_summary = rng.random() < 0.8
        if self.repeats or rng.random() < 0.5:
            self.data += DEFINED
        else:
            self.chunk([DEFINED])

    def message(self):
        """Return channel, time and record of a message."""
        self.time += self.rng.randrange(-30, 50)
        number, time = self.rng.choice(list(TOPICS)), max(self.time, 0)
        self.counts[number] += 1
        self.times.append(time)
        content = pack("<HIQQ", number, 0, time, time) + b"\0\1\0\0" + pack("<B", time % 100)
        return number, time, record(5, content)

    def chunk(self, first=()):
        """Add a chunk, with indexes or without."""
        records, indexes, times = b"".join(first), {}, []
        for _ in range(self.rng.randrange(6)):
            if self.rng.random() < 0.1:
                records += record(0x81, b"private")
            number, time, one = self.message()
            indexes.setdefault(number, []).append((time, len(records)))
            records += one
            times.append(time)
        name = self.rng.choice(list(COMPRESS))
        stored = COMPRESS[name](records)
        first, last = min(times, default=0), max(times, default=0)
        if not self.has_summary and self.rng.random() < 0.1:
            first, last = 5, 6
        head = pack("<QQQI", first, last, len(records), zlib.crc32(records)) + text(name)
        whole = record(6, head + pack("<Q", len(stored)) + stored)
        at, behind, places = len(self.data), b"", b""
        self.data += whole
        if self.rng.random() < 0.8:
            for number, entries in indexes.items():
                if self.rng.random() < 0.02:
                    entries.pop()
                    self.lies = self.has_summary
                if not entries:
                    continue
                places += pack("<HQ", number, len(self.data) + len(behind))
                packed = b"".join(pack("<QQ", *one) for one in entries)
                behind += record(7, pack("<H", number) + text(packed))
            self.data += behind
        kept = self.rng.random() < 0.8
        if self.rng.random() < 0.02 and len(places) > 10:
            places, self.lies = places[10:], self.has_summary  # one channel of several
        content = pack("<QQQQ", first, last, at, len(whole)) + text(places if kept else b"")
        content += pack("<Q", len(behind)) + text(name) + pack("<QQ", len(stored), len(records))
        self.chunk_indexes.append(record(8, content))

    def finished(self):
        """Return the bytes of the file."""
        for _ in range(self.rng.randrange(12)):
            match self.rng.randrange(8):
                case 0 | 1:
                    self.data += self.message()[2]
                case 2:
                    self.data += record(12, text(b"x") + text(b""))
                case 3:
                    self.data += DEFINED
                case 4:
                    self.data += record(15, pack("<I", 0))
                case _:
                    self.chunk()
        if not self.has_summary and self.rng.random() < 0.5:
            return self.data
        self.data += record(15, pack("<I", 0))
        start = len(self.data)
        if not self.has_summary:
            return self.data + record(2, pack("<QQI", 0, 0, 0)) + MAGIC
        chunks = self.chunk_indexes if self.rng.random() < 0.9 else self.chunk_indexes[1:]
        self.rng.shuffle(chunks)
        total = len(self.times) + (self.rng.random() < 0.05)
        counts = b"".join(pack("<HQ", *one) for one in self.counts.items())
        times = pack("<QQ", min(self.times, default=0), max(self.times, default=0))
        content = pack("<QHIIII", total, 1, len(TOPICS), 0, 0, len(self.chunk_indexes))
        statistics = record(11, content + times + text(counts))
        parts = [*chunks, statistics * (self.rng.random() < 0.9)]
        summary = DEFINED * (self.repeats or self.rng.random() < 0.7) + b"".join(parts)
        return self.data + summary + record(2, pack("<QQI", start, 0, 0)) + MAGIC


def sequential(path):
    """Return topic, time and bytes of all messages, as the mcap library reads them."""
    with path.open("rb") as file:
        found = StreamReader(file, skip_magic=False).records
        messages = []
        with suppress(Exception):  # a file that was not closed ends somewhere
            messages.extend(one for one in found if isinstance(one, Message))
        return [(TOPICS[one.channel_id], one.log_time, one.data) for one in messages]


def read(path, window, **options):
    """Return the same, as idlc reads it; a topic after the other."""
    found = []
    with open_recording(path, **options) as container:
        for topic in container.topics:
            for some in container.messages(topic, window):
                times = some.log_times.tolist()
                views = map(bytes, some.views())
                found += [(topic.name, *one) for one in zip(times, views, strict=True)]
    return found


@pytest.mark.rounds
def test_no_window_loses_a_message(tmp_path):
    rng, path, lies = random.Random(SEED), tmp_path / "a.mcap", 0
    for number in range(rounds(600)):
        file = File(rng)
        path.write_bytes(file.finished())
        every = sorted(sequential(path), key=lambda one: one[0])
        assert len(every) == len(file.times)
        times = [*file.times, 0, 10**6]
        windows = [Window(*sorted(rng.choices(times, k=2))) for _ in range(3)]
        for window in (Window(), Window(start=0), *windows):
            for index in (True, False):
                start, end = (10**9 * n if one is None else one for n, one in enumerate(window))
                wanted = [one for one in every if start <= one[1] < end]
                assert read(path, window, index=index) == wanted, (number, window)
        lies += file.lies
    assert lies


@pytest.mark.parametrize("what", ["schema 1", "channel 2"])
@pytest.mark.parametrize("chunked", [True, False])
def test_an_id_that_is_defined_in_two_ways_is_an_error(what, chunked, tmp_path):
    """Otherwise messages would be read as those of the other."""
    path, file = tmp_path / "a.mcap", File(random.Random(SEED))
    file.chunk()
    changed = {"schema 1": (b"int8", b"bool"), "channel 2": (b"/b", b"/c")}[what]
    if chunked:
        file.chunk([DEFINED.replace(*changed)])
    else:
        file.data += DEFINED.replace(*changed)
    path.write_bytes(file.data)
    with pytest.raises(RecordingError, match=f"{what} has two different definitions"):
        open_recording(path)


def test_a_file_that_is_cut_off_while_it_is_open_is_an_error(tmp_path):
    """It does not end the process, as a mapped file would."""
    path, data = tmp_path / "a.mcap", large()
    for size in (0, 100, len(data) // 2, len(data) - 1):
        path.write_bytes(data)
        with idlc.Recording(path) as recording:
            before = [topic.to_columns().to_list() for topic in recording.values()]
            os.truncate(path, size)
            with pytest.raises(RecordingError, match="cut off at byte") as caught:
                assert before == [topic.to_columns().to_list() for topic in recording.values()]
            assert f"`{path}`" in str(caught.value)


def large():
    """Return a file that is not read as a whole at once."""
    file = File(random.Random(SEED))
    while len(file.data) < 300_000:
        file.chunk()
    return file.data


def test_a_file_that_is_replaced_while_it_is_open_is_an_error(tmp_path):
    path, other = tmp_path / "a.mcap", tmp_path / "b.mcap"
    path.write_bytes(large())
    with idlc.Recording(path) as recording:
        other.write_bytes(large())
        os.utime(other, (1, 1))
        other.replace(path)
        with pytest.raises(RecordingError, match="was replaced while"):
            [topic.to_columns() for topic in recording.values()]


def test_neighbours_are_read_from_a_file_that_is_opened_once(tmp_path, monkeypatch):
    path, opened = tmp_path / "a.mcap", []
    path.write_bytes(large())

    def counted(*words):
        opened.append(words)
        return FileIO(*words)

    with open_recording(path) as container:
        monkeypatch.setattr(source, "FileIO", counted)
        for topic in container.topics:
            list(container.messages(topic, Window()))
        assert len(opened) <= 2 * len(container.topics)


def test_threads_read_one_file_at_once(tmp_path):
    path = tmp_path / "a.mcap"
    path.write_bytes(large())
    with idlc.Recording(path) as recording, ThreadPoolExecutor(4) as threads:
        wanted = [topic.to_arrow() for topic in recording.values()]
        for found in threads.map(lambda topic: topic.to_arrow(), [*recording.values()] * 10):
            assert any(found.equals(one) for one in wanted)


def test_many_files_are_one_recording_whatever_may_be_open_at_once(tmp_path):
    resource = pytest.importorskip("resource")
    file = File(random.Random(SEED))
    file.chunk()
    for number in range(300):
        (tmp_path / f"bag_{number}.mcap").write_bytes(file.data)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (100, hard))
    try:
        assert len(read(tmp_path, Window())) == 300 * len(file.times)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
