"""Damaged recordings: whole messages around the damage are read, and the damage is reported."""

import random
import shutil
import sqlite3
import tracemalloc
import warnings
from collections import Counter
from contextlib import closing, suppress

import pytest
import yaml
from mcap.reader import make_reader
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader

import idlc
from idlc.cli.main import main
from idlc.recordings.containers.compression import compress, decompressed
from idlc.recordings.containers.container import open_recording
from idlc.recordings.containers.messages import ALWAYS, NO_TIME
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.damage import DamageWarning
from idlc.recordings.rewrite import rewrite
from tests.support import mcap_mutations
from tests.support import recordings as made
from tests.support.rounds import ALL, SEED

MESSAGES = made.messages(120)
TOPICS = dict(enumerate(made.MAKERS, 1))
WHOLE = Counter((one.log_time, one.data) for one in MESSAGES)


def mcap_files(folder):
    """Yield kinds of MCAP files: their bytes, and whether checksums cover the messages."""
    for compression in made.COMPRESSIONS:
        for name, options in {
            "chunks": {"chunk_size": 3000},
            "unproven": {"chunk_size": 3000, "enable_crcs": False},
            "loose": {"use_chunking": False},
            "bare": {"chunk_size": 3000, "index_types": made.INDEX_TYPES.NONE},
        }.items():
            path = made.by_mcap(folder / "sound.mcap", MESSAGES, compression, **options)
            data = path.read_bytes()
            is_proven = name in ("chunks", "bare")
            yield data, is_proven
            yield not_closed(data), is_proven


def not_closed(data):
    """Return an MCAP file without what follows its messages."""
    return data[: next(one.at for one in mcap_mutations.records(data[:-8], 8) if one.op == 15)]


def database(path, page):
    """Write a .db3 file with the messages."""
    path.unlink(missing_ok=True)
    with closing(sqlite3.connect(path)) as file:
        file.execute(f"PRAGMA page_size={page}")
        file.executescript(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT,"
            " serialization_format TEXT, offered_qos_profiles TEXT);"
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER,"
            " data BLOB);"
        )
        rows = [(number, topic, made.MAKERS[topic][0]) for number, topic in TOPICS.items()]
        file.executemany("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')", rows)
        numbers = {topic: number for number, topic in TOPICS.items()}
        file.executemany(
            "INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)",
            [(numbers[one.topic], one.log_time, one.data) for one in MESSAGES],
        )
        file.commit()
    return path.read_bytes()


def damaged(data, rng):
    """Return a file with damage in one place or two."""
    raw = bytearray(data)
    for _ in range(rng.choice([1, 1, 1, 2])):
        at = rng.randrange(8, len(raw))
        size = min(rng.choice([1, 8, 100, 512, 4096]), len(raw) - at)
        match rng.randrange(5):
            case 0:
                raw[at : at + size] = bytes(size)
            case 1:
                raw[at : at + size] = rng.randbytes(size)
            case 2:
                raw[at] ^= 1 << rng.randrange(8)
            case 3:
                raw[at:] = bytes(len(raw) - at)
            case _:
                del raw[at:]
                if len(raw) <= 8:
                    return bytes(data)
    return bytes(raw)


def read(path, **options):
    """Return the messages that idlc reads, and the container."""
    found = Counter()
    with open_recording(path, **options) as container:
        for topic in container.topics:
            with suppress(RecordingError):
                for some in container.messages(topic, ALWAYS):
                    pairs = zip(some.log_times.tolist(), map(bytes, some.views()), strict=True)
                    found.update(pairs)
    return found, container


def in_stream(file):
    """Yield the topic of each message of a defined channel, and the message."""
    topics = {}
    for one in StreamReader(file, validate_crcs=True).records:
        if isinstance(one, Channel):
            topics[one.id] = one.topic
        if isinstance(one, Message):
            yield topics.get(one.channel_id), one


def of_mcap(path):
    """Return the messages that the readers of the mcap library yield before they stop."""
    found = []
    for reader in ("stream", "seeking"):
        messages = Counter()
        with path.open("rb") as file, suppress(Exception):
            if reader == "stream":
                every = in_stream(file)
            else:
                seeking = make_reader(file, validate_crcs=True)
                summary = seeking.get_summary()
                # without indexes, it does not compare checksums
                has_indexes = summary is not None and len(summary.chunk_indexes) > 0
                pairs = seeking.iter_messages() if has_indexes else ()
                every = ((channel.topic, one) for _, channel, one in pairs)
            for topic, one in every:
                time = one.log_time if one.log_time < 1 << 63 else NO_TIME
                messages[time, bytes(one.data)] += topic is not None
        found.append(messages)
    return found[0] | found[1]


@pytest.mark.rounds
def test_what_the_mcap_library_reads_of_a_damaged_file_is_read(tmp_path):
    rng, path, found, lost = random.Random(SEED), tmp_path / "a.mcap", 0, 0
    sound = list(mcap_files(tmp_path))
    for number in range(1400 if ALL else 24):
        data, is_proven = sound[number % len(sound)]
        path.write_bytes(damaged(data, rng))
        try:
            messages, container = read(path, check=True)
        except RecordingError as error:
            assert "two different definitions" in error.message  # noqa: PT017
            continue
        expected = of_mcap(path)
        # without checksums, a chunk is only read until the damage in it
        assert not (expected - messages) or (container.damage and not is_proven), number
        if is_proven:
            assert not (messages - WHOLE), number
        elif container.damage and messages:
            assert "no checksum covers" in " ".join(container.notes), number
        found += messages.total() - expected.total()
        lost += WHOLE.total() - messages.total()
        assert (
            container.damage
            or not is_proven
            or not (WHOLE - messages)
            or "not closed" in str(container.notes)
        )
    assert found > 0
    assert lost > 0


@pytest.mark.parametrize("indexes", ["ALL", "NONE"])
def test_a_damaged_head_of_a_chunk_costs_no_other_chunk(indexes, tmp_path):
    options = {"chunk_size": 3000, "index_types": made.INDEX_TYPES[indexes]}
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES, **options)
    data = not_closed(path.read_bytes())  # so nothing lists the chunks
    records = mcap_mutations.records(data, 8)
    chunks = [record for record in records if record.op == mcap_mutations.CHUNK]
    for chunk in chunks[1:-1]:
        path.write_bytes(data[: chunk.at] + bytes(9) + data[chunk.at + 9 :])
        inside = [record.op for record in mcap_mutations.in_chunk(chunk)]
        assert (WHOLE - read(path)[0]).total() == inside.count(mcap_mutations.MESSAGE)


#: Damage of which copies once were damaged, or lacked messages; and more of these kinds.
COPIED = (2, 15, 36, 117, 129, 165, 170)


@pytest.mark.rounds
def test_a_copy_has_what_is_read_of_a_damaged_file_and_no_damage(tmp_path):
    path, target, copied = tmp_path / "a.mcap", tmp_path / "b.mcap", 0
    sound = list(mcap_files(tmp_path))
    for seed in range(SEED, SEED + 700) if ALL else COPIED:
        path.write_bytes(damaged(sound[seed % len(sound)][0], random.Random(seed)))
        try:
            messages, _ = read(path, check=True)
        except RecordingError as error:
            assert "two different definitions" in error.message  # noqa: PT017
            continue
        target.unlink(missing_ok=True)
        topics = rewrite(str(path), str(target), {}).topics
        again, copy = read(target)
        assert again == messages, seed
        assert not copy.damage, seed
        assert "read from" not in " ".join(copy.notes), seed
        assert sum(topic.messages for topic in topics.values()) == again.total()
        copied += again.total()
    assert copied > 0


#: Numbers of damages by one generator, for kinds that one in a hundred shows.
RARE = (98, 123, 178, 399, 496, 596, 816, 1245)


@pytest.mark.long
def test_copies_of_rare_damage_have_what_is_read(tmp_path):
    path, rng = tmp_path / "a.mcap", random.Random(992026)
    sound = list(mcap_files(tmp_path))
    for number in range(RARE[-1] + 1):
        raw = damaged(sound[number % len(sound)][0], rng)
        if number in RARE:
            path.write_bytes(raw)
            messages, _ = read(path, check=True)
            rewrite(str(path), str(tmp_path / f"{number}.mcap"), {})
            again, copy = read(tmp_path / f"{number}.mcap")
            assert again == messages, number
            assert not copy.damage, number


def split_with_metadata(folder, storage, style):
    """Write a bag of three files with a metadata.yaml, as rosbag2 does."""
    folder.mkdir()
    parts = [MESSAGES[number * 40 : number * 40 + 40] for number in range(3)]
    for number, part in enumerate(parts):
        single = made.by_rosbags(folder / f"b{number}", part, storage)
        (file,) = single.glob(f"*.{storage}")
        file.rename(folder / f"bag_{number}.{storage}")
        content = yaml.safe_load((single / "metadata.yaml").read_text(encoding="utf-8"))
        shutil.rmtree(single)
    information = content["rosbag2_bagfile_information"]
    information |= {
        "message_count": 120,
        "relative_file_paths": [f"bag_{number}.{storage}" for number in range(3)],
        "files": [
            {"path": f"bag_{number}.{storage}", "message_count": 40, "duration": {"nanoseconds": 5}}
            for number in range(3)
        ],
    }
    for topic in information["topics_with_message_count"]:
        topic["message_count"] = 40
    text = yaml.safe_dump(content, default_flow_style=style, sort_keys=False)
    (folder / "metadata.yaml").write_text(text, encoding="utf-8")


@pytest.mark.parametrize(
    ("storage", "style", "loss"),
    [("mcap", False, "empty"), ("mcap", True, "cut"), ("db3", False, "gone"), ("db3", None, "cut")],
)
def test_the_metadata_of_a_copy_counts_what_is_there(storage, style, loss, tmp_path):
    split_with_metadata(tmp_path / "bag", storage, style)
    lost = tmp_path / "bag" / f"bag_1.{storage}"
    data = b"" if loss == "empty" else lost.read_bytes()
    lost.write_bytes(data[: len(data) * 2 // 3])
    if loss == "gone":
        lost.unlink()
    assert rewrite(str(tmp_path / "bag"), str(tmp_path / "copy"), {}).damage
    text = (tmp_path / "copy" / "metadata.yaml").read_text(encoding="utf-8")
    information = yaml.safe_load(text)["rosbag2_bagfile_information"]
    names = sorted(path.name for path in (tmp_path / "copy").glob("*.mcap"))
    messages, container = read(tmp_path / "copy")
    assert not container.damage
    assert not container.notes
    assert information["relative_file_paths"] == names
    assert [file["path"] for file in information["files"]] == names
    counts = [file["message_count"] for file in information["files"]]
    assert counts[0] == counts[-1] == 40
    assert sum(counts) == information["message_count"] == messages.total() < 120
    for written, place in ((information, ""), *zip(information["files"], names, strict=True)):
        _, part = read(tmp_path / "copy" / place)
        start, end = part.span() or (0, 0)
        assert written["starting_time"] == {"nanoseconds_since_epoch": start}
        assert written["duration"] == {"nanoseconds": end - start}
    every = [each["message_count"] for each in information["topics_with_message_count"]]
    assert sum(every) == messages.total()


def test_the_types_of_one_topic_are_counted_apart(tmp_path):
    kinds = ["sensor_msgs/msg/Imu", "sensor_msgs/msg/JointState"]
    (tmp_path / "bag").mkdir()
    for number, kind in enumerate(kinds):
        messages = [message._replace(topic="/t") for message in MESSAGES if message.type == kind][
            number:
        ]
        made.by_mcap(tmp_path / "bag" / f"bag_{number}.mcap", messages)
    (tmp_path / "bag" / "bag_2.mcap").touch()
    listed = [
        {"topic_metadata": {"name": "/t", "type": kind}, "message_count": 500} for kind in kinds
    ]
    files = [f"bag_{number}.mcap" for number in range(3)]
    information = {"relative_file_paths": files, "topics_with_message_count": listed}
    text = yaml.safe_dump({"rosbag2_bagfile_information": information})
    (tmp_path / "bag" / "metadata.yaml").write_text(text, encoding="utf-8")
    assert rewrite(str(tmp_path / "bag"), str(tmp_path / "copy"), {}).damage
    text = (tmp_path / "copy" / "metadata.yaml").read_text(encoding="utf-8")
    written = yaml.safe_load(text)["rosbag2_bagfile_information"]["topics_with_message_count"]
    counts = {each["topic_metadata"]["type"]: each["message_count"] for each in written}
    every = [sum(message.type == kind for message in MESSAGES) for kind in kinds]
    assert counts == {kinds[0]: every[0], kinds[1]: every[1] - 1}


def of_sqlite(path):
    """Return the messages that SQLite finds, each row by itself."""
    messages = Counter()
    with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as file:
        for row in range(1, len(MESSAGES) + 2):
            query = "SELECT topic_id, timestamp, data FROM messages WHERE id = ?"
            with suppress(sqlite3.Error, UnicodeError):
                for topic, time, data in file.execute(query, (row,)):
                    if isinstance(time, int) and isinstance(data, bytes) and topic in TOPICS:
                        messages[time, data] += 1
    return messages


def has_topics(path):
    """Return whether SQLite reads the topics, as texts."""
    query = "SELECT name, type, serialization_format FROM topics"
    with closing(sqlite3.connect(path)) as file, suppress(sqlite3.Error, UnicodeError):
        rows = file.execute(query).fetchall()
        return all(isinstance(value, str) for row in rows for value in row)
    return False


@pytest.mark.rounds
def test_what_sqlite_reads_of_a_damaged_file_is_read(tmp_path):
    rng, path, partial = random.Random(SEED), tmp_path / "a.db3", 0
    sound = [database(tmp_path / "sound.db3", page) for page in (512, 1024, 4096)]
    for number in range(600 if ALL else 12):
        data = damaged(sound[number % len(sound)], rng)
        path.write_bytes(data)
        expected = of_sqlite(path)
        if len(data) % (512, 1024, 4096)[number % 3]:
            expected &= WHOLE  # SQLite fills the page with zeros
        try:
            messages, container = read(path)
        except RecordingError:
            assert not (expected and has_topics(path)), number
            continue
        assert not (expected - messages), number
        partial += 0 < messages.total() < WHOLE.total() and bool(container.damage)
    assert partial > 0


def without_a_chunk(path):
    """Write a file of which the middle is lost; return the number of messages before and after."""
    data = bytearray(made.by_mcap(path, MESSAGES, chunk_size=3000).read_bytes())
    chunks = [one for one in mcap_mutations.records(bytes(data[:-8]), 8) if one.op == 6]
    middle = chunks[len(chunks) // 2]
    data[middle.at + 60 : middle.at + 90] = bytes(30)
    path.write_bytes(data)
    inside = sum(one.op == mcap_mutations.MESSAGE for one in mcap_mutations.in_chunk(middle))
    return len(MESSAGES) - inside if inside else 0


def cut_database(path):
    data = database(path, 1024)
    path.write_bytes(data[: len(data) * 2 // 3])


def split_bag(folder, last):
    """Write a bag of three files, of which the last has other bytes."""
    folder.mkdir()
    for number in range(3):
        made.by_mcap(folder / f"bag_{number}.mcap", MESSAGES[number * 40 : number * 40 + 40])
    (folder / "bag_2.mcap").write_bytes(last)


CASES = {
    "hole": lambda path: without_a_chunk(path / "a.mcap"),
    "database": lambda path: cut_database(path / "a.db3"),
    "empty file": lambda path: split_bag(path / "a", b""),
    "zeros": lambda path: split_bag(path / "a", bytes(5000)),
    "pointer": lambda path: split_bag(path / "a", b"version https://git-lfs.github.com/spec/v1\n"),
}


@pytest.mark.parametrize("case", CASES)
def test_commands_write_the_rest_and_fail(case, tmp_path, capsys):
    CASES[case](tmp_path)
    (path,) = (one for one in tmp_path.iterdir() if one.name.startswith("a"))
    out = tmp_path / "x.csv"
    assert main(["columns", str(path), "/imu", "--format", "csv", "-o", str(out)]) == 1
    assert "error[IDL656]" in capsys.readouterr().err
    rows = len(out.read_text(encoding="utf-8").splitlines()) - 1
    assert 0 < rows < 40
    # a hole in a file with a summary is only found when its messages are read
    for command in ("check",) if case == "hole" else ("check", "show"):
        assert main([command, str(path)]) == 1
        assert "IDL656" in "".join(capsys.readouterr())
    assert main(["columns", str(path), "/imu", "--strict", "-o", str(tmp_path / "y.csv")]) == 1
    assert "IDL651" in capsys.readouterr().err
    assert not (tmp_path / "y.csv").exists()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with idlc.Recording(path) as recording:
            assert recording["/imu"].to_arrow().num_rows == rows
            assert recording.damage
    assert DamageWarning in {warning.category for warning in caught}
    target = tmp_path / "b"
    assert rewrite(str(path), str(target), {}).damage
    with idlc.Recording(target) as recording:
        assert len(recording["/imu"].to_columns()) == rows
        if path.is_file():
            assert recording.notes == recording.damage == ()


def test_a_wrong_checksum_is_found_by_check(tmp_path, capsys):
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES, "")
    data = bytearray(path.read_bytes())
    data[data.index(MESSAGES[30].data) + 40] ^= 1
    path.write_bytes(data)
    assert main(["check", str(path)]) == 1
    said = "".join(capsys.readouterr())
    assert "the checksum of the chunk" in said
    assert "IDL656" in said


@pytest.mark.parametrize("field", ["log_time", "publish_time"])
@pytest.mark.parametrize("late", [1 << 63, (1 << 64) - 1, 0xE86D_1A37_6CA4_6A6B])
def test_a_late_time_is_null(field, late, tmp_path):
    found = [
        one._replace(**{field: late}) if index == 3 else one
        for index, one in enumerate(MESSAGES[:12])
    ]
    path = made.by_mcap(tmp_path / "a.mcap", found)
    with idlc.Recording(path) as recording:
        topic = recording["/imu"]
        assert topic.to_arrow()[field].null_count == 1
        assert topic.to_pandas()[field].isna().tolist() == [False, True, False, False]
        assert "after the year 2262" in " ".join(recording.notes)
        if field == "log_time":
            assert [time for time, _ in topic][1] is None
            assert topic.between(end="0.5").to_arrow().num_rows == 2 - 1


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_a_chunk_of_unknown_size_needs_memory_in_proportion(compression):
    """The size that a damaged chunk declares is not known to be right."""
    content = random.Random(SEED).randbytes(100_000)
    data = memoryview(compress(content, compression))
    tracemalloc.start()
    assert decompressed(data, compression) == content
    assert tracemalloc.get_traced_memory()[1] < 40 * len(content)
    tracemalloc.stop()
    repeated = content[:2_000] * 1_000
    assert decompressed(memoryview(compress(repeated, compression)), compression) == repeated
