"""Messages are read as they were recorded, with the help of indexes and without."""

import random
import shutil
import sqlite3
from contextlib import closing
from struct import pack, unpack_from

import lz4.frame
import pytest

from idlc.recordings.containers import records as mcap
from idlc.recordings.containers.compression import PIECE, decompress
from idlc.recordings.containers.container import open_recording
from idlc.recordings.containers.messages import Window, join_messages
from idlc.recordings.containers.source import DamageError, RecordingError
from tests.recordings.test_containers import LEAVES_OUT, MESSAGES
from tests.support import mcap_mutations
from tests.support import recordings as made

#: Chunks with a few messages each.
SMALL = 3000


def read(path, topic, window=None, **options):
    """Return what is read of a topic, by way of all of them as one."""
    with open_recording(path, **options) as container:
        (found,) = (one for one in container.topics if one.name == topic)
        parts = list(container.messages(found, Window(*(window or ()))))
        whole = join_messages(parts)
        assert len(whole) == sum(map(len, parts))
        views = whole.views()
        assert [view for part in parts for view in part.views()] == views
        times = whole.log_times.tolist()
        publish = whole.publish_times
        publish = [None] * len(times) if publish is None else publish.tolist()
        return list(zip(times, publish, map(bytes, views), strict=True))


def recorded(topic, found=MESSAGES, publish=True):
    mine = made.of_topic(found, topic)
    return [(one.log_time, one.publish_time if publish else None, one.data) for one in mine]


@pytest.mark.parametrize("left_out", LEAVES_OUT)
@pytest.mark.parametrize("compression", made.COMPRESSIONS)
@pytest.mark.parametrize("index", [True, False])
def test_mcap_files(left_out, compression, index, tmp_path):
    options = {"chunk_size": SMALL, **LEAVES_OUT[left_out]}
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES, compression, **options)
    for topic in made.MAKERS:
        assert read(path, topic, index=index, check=True) == recorded(topic)
        with path.open("rb") as file:
            assert read(file, topic, index=index) == recorded(topic)


@pytest.mark.parametrize(
    ("storage", "compression"),
    [("db3", ""), ("db3", "message"), ("mcap", ""), ("mcap", "storage")],
)
def test_bags_of_rosbags(storage, compression, tmp_path):
    bag = made.by_rosbags(tmp_path / "bag", MESSAGES, storage, compression)
    for topic in made.MAKERS:
        publish = storage == "mcap"
        wanted = [(log, log if publish else None, data) for log, _, data in recorded(topic)]
        assert read(bag, topic) == wanted
    (bag / "metadata.yaml").unlink()
    assert read(bag, topic) == wanted


def test_a_split_bag_is_one(tmp_path):
    for number in range(3):
        part = MESSAGES[number * 20 : number * 20 + 20]
        made.by_mcap(tmp_path / f"bag_{number}.mcap", part, ["", "zstd", "lz4"][number])
    for topic in made.MAKERS:
        assert read(tmp_path, topic) == recorded(topic)


@pytest.mark.parametrize("storage", ["mcap", "db3"])
def test_a_window_begins_with_its_start_and_ends_before_its_end(storage, tmp_path):
    if storage == "db3":
        path = made.by_rosbags(tmp_path / "bag", MESSAGES, storage)
    else:
        path = made.by_mcap(tmp_path / "a.mcap", MESSAGES, chunk_size=SMALL)
    topic = "/joints"
    times = [log for log, *_ in recorded(topic)]
    bounds = [None, 0, -5, times[0], times[3], times[3] + 1, times[-1], times[-1] + 1, 1 << 70]
    for start in bounds:
        for end in bounds:
            wanted = [
                time
                for time in times
                if (start is None or time >= start) and (end is None or time < end)
            ]
            assert [log for log, *_ in read(path, topic, (start, end))] == wanted, (start, end)


def test_messages_of_several_channels_and_out_of_order_come_as_they_were_recorded(tmp_path):
    found = made.messages(30)
    mixed = [one for pair in zip(found[1::2], found[::2], strict=True) for one in pair]
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = made.Writer(file, chunk_size=SMALL)
        writer.start()
        kinds = {name: name for name, _ in made.MAKERS.values()}
        for name in kinds:
            kinds[name] = writer.register_schema(name, "ros2msg", made.definition(name).encode())
        channels = {
            (topic, number): writer.register_channel(topic, "cdr", kinds[name], {"n": str(number)})
            for topic, (name, _) in made.MAKERS.items()
            for number in range(2)
        }
        for number, one in enumerate(mixed):
            channel = channels[one.topic, number % 2]
            writer.add_message(channel, one.log_time, one.data, one.publish_time)
        writer.finish()
    for topic in made.MAKERS:
        assert read(path, topic) == recorded(topic, mixed)
        assert read(path, topic, index=False) == recorded(topic, mixed)


@pytest.mark.parametrize("compression", made.COMPRESSIONS)
def test_a_truncated_file_has_its_first_messages(compression, tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES, compression, chunk_size=SMALL)
    whole = path.read_bytes()
    wanted, before = recorded("/imu"), 0
    for size in range(len(whole) // 4, len(whole), 1009):
        path.write_bytes(whole[:size])
        found = read(path, "/imu")
        assert found == wanted[: len(found)]
        assert len(found) >= before
        before = len(found)
    assert before == len(wanted)


@pytest.mark.parametrize("more", [0, 5])
def test_a_chunk_is_whole_though_its_indexes_are_cut_off(more, tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES, chunk_size=SMALL)
    whole, there = path.read_bytes(), 0
    for one in mcap_mutations.records(whole[:-8], 8):
        if one.op == mcap_mutations.CHUNK:
            inside = mcap_mutations.in_chunk(one)
            there += sum(record.op == mcap_mutations.MESSAGE for record in inside)
        if one.op == mcap_mutations.MESSAGE_INDEX:
            path.write_bytes(whole[: one.at + more])
            with open_recording(path) as container:
                counts = {found.name: found.count for found in container.topics}
            assert sum(counts.values()) == there
            for topic, count in counts.items():
                assert read(path, topic) == recorded(topic)[:count]


def test_an_index_that_leaves_messages_out_is_a_lie(tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES)
    parts = mcap_mutations.records(path.read_bytes()[:-8], 8)
    index = next(one for one in parts if one.op == mcap_mutations.MESSAGE_INDEX)
    size = unpack_from("<I", index.content, 2)[0] - 16
    index.content[2:] = pack("<I", size) + index.content[6 : 6 + size]
    chunk = next(one for one in parts if one.op == mcap_mutations.CHUNK_INDEX)
    at = chunk.fields()[5].at
    (told,) = unpack_from("<Q", chunk.content, at)
    chunk.content[at : at + 8] = pack("<Q", told - 16)
    path.write_bytes(mcap_mutations.joined(parts, up_to_date=True))
    for window in ((None, None), (None, made.START + 1), (made.START, None)):
        expected = recorded("/imu")[:1] if window[1] else recorded("/imu")
        assert read(path, "/imu", window) == expected
    assert read(path, "/imu", index=False) == recorded("/imu")
    assert read(path, "/joints") == recorded("/joints")


def test_what_a_recorder_has_not_written_back_is_read(tmp_path):
    bag = made.by_rosbags(tmp_path / "bag", MESSAGES, "db3")
    (path,) = bag.glob("*.db3")
    database = sqlite3.connect(path)
    assert database.execute("PRAGMA journal_mode=WAL").fetchone() == ("wal",)
    database.execute("PRAGMA wal_autocheckpoint=0")
    database.execute("DELETE FROM messages WHERE id > 30")
    database.commit()
    assert path.with_name(path.name + "-wal").stat().st_size
    copy = tmp_path / "copy"
    shutil.copytree(bag, copy)
    database.close()
    assert read(copy, "/imu") == [
        (log, None, data) for log, _, data in recorded("/imu", MESSAGES[:30])
    ]


def places(data, op, at=8):
    """Yield where records of a kind begin; those in chunks are not seen."""
    while at + 9 <= len(data):
        found, size = mcap.HEAD.unpack_from(data, at)
        if found == op:
            yield at
        at += 9 + size


def lies():
    """Yield ways in which a file of one channel can lie, and what is then said."""

    def index_entry(data, value):
        at = next(places(data, mcap.MESSAGE_INDEX_OP))
        data[at + 9 + 6 + 8 : at + 9 + 6 + 16] = pack("<Q", value)

    yield "leaves its chunk", lambda data: index_entry(data, 1 << 40)
    yield "leaves its chunk", lambda data: index_entry(data, (1 << 64) - 1)
    yield "no message of its channel", lambda data: index_entry(data, 1)

    def doubled(data):
        at = next(places(data, mcap.MESSAGE_INDEX_OP)) + 9 + 6
        data[at + 16 : at + 32] = data[at : at + 16]

    yield "overlap", doubled

    def message_size(data, value):
        chunk = next(places(data, mcap.CHUNK_OP))
        (first,) = unpack_from("<Q", data, next(places(data, 7)) + 9 + 6 + 8)
        at = chunk + 9 + 8 + 8 + 8 + 4 + 4 + 8 + first
        data[at + 1 : at + 9] = pack("<Q", value)

    yield "cut off", lambda data: message_size(data, 1 << 50)
    yield "cut off", lambda data: message_size(data, 3)

    def index_record(data, field, value):
        at = next(places(data, mcap.MESSAGE_INDEX_OP)) + field
        data[at : at + len(value)] = value

    yield "no index of messages", lambda data: index_record(data, 0, b"\x05")
    yield "of another channel", lambda data: index_record(data, 9, b"\x09\x00")
    yield "bytes expected", lambda data: index_record(data, 1, pack("<Q", 1 << 60))
    yield "cut off", lambda data: index_record(data, 11, pack("<I", 1 << 31))

    def chunk_head(data, field, value):
        at = next(places(data, mcap.CHUNK_OP)) + 9 + field
        data[at : at + len(value)] = value

    yield "another size", lambda data: chunk_head(data, 16, pack("<Q", 1 << 20))
    yield "declares", lambda data: chunk_head(data, 16, pack("<Q", 1 << 50))
    yield "no chunk", lambda data: chunk_head(data, -9, b"\x05")
    yield "checksum of the chunk", lambda data: chunk_head(data, 24, b"\1\2\3\4")


@pytest.mark.parametrize("lie", list(lies()), ids=lambda lie: lie[0])
def test_a_lying_file_is_refused(lie, tmp_path):
    message, change = lie
    found = [one for one in MESSAGES if one.topic == "/imu"]
    path = made.by_mcap(tmp_path / "a.mcap", found, "", chunk_size=SMALL)
    data = bytearray(path.read_bytes())
    change(data)
    path.write_bytes(data)
    with pytest.raises(RecordingError, match=message) as caught:
        read(path, "/imu", check="checksum" in message, strict=True)
    assert str(path) in caught.value.message


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
@pytest.mark.parametrize("declared", [-1, 1, 1 << 28])
def test_a_chunk_that_holds_another_size_is_refused(compression, declared, tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES, compression, chunk_size=1 << 20)
    data = bytearray(path.read_bytes())
    at = next(places(data, mcap.CHUNK_OP)) + 9 + 16
    (size,) = unpack_from("<Q", data, at)
    data[at : at + 8] = pack("<Q", size + declared)
    path.write_bytes(data)
    with pytest.raises(RecordingError, match=r"declares [\d,]+ bytes and holds"):
        read(path, "/imu", strict=True)
    assert read(path, "/imu") == recorded("/imu")  # as the checksum proves


@pytest.mark.parametrize("block_size", [lz4.frame.BLOCKSIZE_MAX64KB, lz4.frame.BLOCKSIZE_MAX4MB])
@pytest.mark.parametrize("size", [0, 1, PIECE - 1, PIECE, PIECE + 1, 5 * PIECE, 9 << 19])
def test_blocks_of_lz4_need_not_be_as_large_as_pieces(block_size, size):
    data = random.Random(size).randbytes(1000) * (size // 1000 + 1)
    frame = memoryview(lz4.frame.compress(data[:size], block_size=block_size))
    target = memoryview(bytearray(size))
    decompress(frame, "lz4", target)
    assert target == data[:size]
    with pytest.raises(DamageError, match=rf"declares {size + 1:,} bytes and holds {size:,}"):
        decompress(frame, "lz4", memoryview(bytearray(size + 1)))
    if size:
        with pytest.raises(DamageError, match="holds more"):
            decompress(frame, "lz4", target[1:])


def test_a_chunk_that_cannot_be_decompressed_is_refused(tmp_path):
    for compression in ("zstd", "lz4"):
        path = made.by_mcap(tmp_path / "a.mcap", MESSAGES, compression)
        data = bytearray(path.read_bytes())
        at = next(places(data, mcap.CHUNK_OP))
        data[at + 60 : at + 200] = b"x" * 140
        path.write_bytes(data)
        with pytest.raises(RecordingError, match="cannot be decompressed"):
            read(path, "/imu")


def test_chunks_that_a_summary_names_twice_are_read_once(tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES, "", chunk_size=SMALL)
    data = bytearray(path.read_bytes())
    first, second, *_ = places(data, mcap.CHUNK_INDEX_OP)
    data[second + 9 : second + 41] = data[first + 9 : first + 41]
    data[-12:-8] = pack("<I", 0)
    path.write_bytes(data)
    assert read(path, "/imu") == recorded("/imu")


def test_a_wrong_checksum_of_the_summary_is_seen(tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES, "", chunk_size=SMALL)
    data = bytearray(path.read_bytes())
    assert data[-12:-8] != bytes(4)
    data[-12] ^= 1
    path.write_bytes(data)
    assert read(path, "/imu") == recorded("/imu")
    with open_recording(path) as container:
        assert "checksum of its summary is wrong" in container.notes[0]


@pytest.mark.parametrize("time", ["'soon'", "1.5", "x'01'"])
@pytest.mark.parametrize("window", [(None, None), (0, 1 << 62), (None, 5)])
def test_a_row_without_a_time_is_lost_in_no_window(time, window, tmp_path):
    (path,) = made.by_rosbags(tmp_path / "bag", MESSAGES, "db3").glob("*.db3")
    with closing(sqlite3.connect(path)) as database:
        database.execute(f"UPDATE messages SET timestamp = {time} WHERE id = 7")  # noqa: S608
        database.commit()
    with pytest.raises(RecordingError, match="row 7 has values of other types"):
        read(path, MESSAGES[6].topic, window, strict=True)
    assert len(read(path, MESSAGES[6].topic)) == 19
