"""What each part of a recording costs: twice as much of it takes twice the work, not four times.

Work is counted in calls and lines of Python, which no other program changes. Each kind of record,
of table and of metadata has a row; a new kind of record without a row fails here.
"""

import contextlib
import io
import sqlite3
import sys
from contextlib import closing
from functools import partial
from struct import pack

import numpy as np
import pytest
import zstandard

import idlc
from idlc.cli.main import main
from idlc.recordings.containers import records as mcap_records
from idlc.recordings.containers.compression import ANY_GROWTH
from idlc.recordings.containers.container import open_recording
from idlc.recordings.containers.messages import Window
from idlc.recordings.containers.source import RecordingError
from tests.support.mcap_mutations import COMPRESS, MAGIC

FLOAT = "float64 data"


def text(words):
    return pack("<I", len(words)) + words


def record(op, content):
    return pack("<BQ", op, len(content)) + content


def schema(number, name="std_msgs/msg/Float64", definition=FLOAT):
    words = (name.encode(), b"ros2msg", definition.encode())
    return record(3, pack("<H", number) + b"".join(map(text, words)))


def channel(number, topic, kind=1, metadata=b""):
    content = pack("<HH", number, kind) + text(topic.encode()) + text(b"cdr") + text(metadata)
    return record(4, content)


def message(number, time=0):
    return record(5, pack("<HIQQ", number, 0, time, time) + b"\0\1\0\0" + bytes(8))


def chunk(records, compression=b"zstd", declared=None):
    stored = COMPRESS[compression](records)
    head = pack("<QQQI", 0, 10**9, len(records) if declared is None else declared, 0)
    return record(6, head + text(compression) + pack("<Q", len(stored)) + stored)


def mcap(data, summary=b"", closed=True):
    data = MAGIC + record(1, text(b"ros2") + text(b"")) + data + record(15, bytes(4))
    start = len(data) if summary else 0
    return data + summary + (record(2, pack("<QQI", start, 0, 0)) + MAGIC) * closed


def indexed(topics, chunks):
    """Return a file with a summary, each of whose chunks has a message of each topic."""
    numbers = range(1, topics + 1)
    data, summary = MAGIC + record(1, text(b"") + text(b"")), schema(1)
    summary += b"".join(channel(number, f"/t{number}") for number in numbers)
    for _ in range(chunks):
        each = [message(number) for number in numbers]
        at, places, behind = len(data), b"", b""
        whole = chunk(b"".join(each), b"")
        data += whole
        for number in numbers:
            places += pack("<HQ", number, len(data) + len(behind))
            entry = pack("<QQ", 0, (number - 1) * len(each[0]))
            behind += record(7, pack("<H", number) + text(entry))
        data += behind
        size = topics * len(each[0])
        content = pack("<QQQQ", 0, 0, at, len(whole)) + text(places) + pack("<Q", len(behind))
        summary += record(8, content + text(b"") + pack("<QQ", size, size))
    counts = b"".join(pack("<HQ", number, chunks) for number in numbers)
    content = pack("<QHIIIIQQ", topics * chunks, 1, topics, 0, 0, chunks, 0, 0) + text(counts)
    start = len(data) + 13
    summary += record(11, content)
    return data + record(15, bytes(4)) + summary + record(2, pack("<QQI", start, 0, 0)) + MAGIC


ONE = schema(1) + channel(1, "/x")
#: Files by what there is much of, and of which kind that is.
RECORDS = {
    "headers": (1, lambda n: mcap(record(1, text(b"") + text(b"")) * n + ONE)),
    "footers": (2, lambda n: mcap(ONE + record(2, bytes(20)) * n)),
    "schemas": (3, lambda n: mcap(b"".join(schema(i) for i in range(1, n)) + ONE)),
    "schemas of one topic": (
        3,
        lambda n: mcap(
            b"".join(
                schema(i, definition=f"float64 f{i}") + channel(i, "/x", i) for i in range(1, n)
            )
        ),
    ),
    "schemas of packages": (
        3,
        lambda n: mcap(
            b"".join(schema(i, f"p{i}/msg/A") + channel(i, f"/t{i}", i) for i in range(1, n))
        ),
    ),
    "definitions in one": (
        3,
        lambda n: mcap(
            schema(1, "p/msg/A", "\n".join(f"{'=' * 80}\nMSG: p/B{i}\nint8 a" for i in range(n)))
            + b"".join(channel(i, f"/t{i}") for i in range(1, n))
        ),
    ),
    "channels": (
        4,
        lambda n: mcap(schema(1) + b"".join(channel(i, f"/t{i}") for i in range(1, n))),
    ),
    "channels of one topic": (
        4,
        lambda n: mcap(schema(1) + b"".join(channel(i, "/x") for i in range(1, n))),
    ),
    "metadata of a channel": (
        4,
        lambda n: mcap(
            schema(1) + channel(1, "/x", 1, b"".join(text(b"%d" % i) * 2 for i in range(n)))
        ),
    ),
    "messages": (5, lambda n: mcap(ONE + message(1) * n)),
    "messages in a chunk": (5, lambda n: mcap(chunk(ONE + message(1) * n))),
    "chunks": (6, lambda n: mcap(ONE + chunk(message(1)) * n)),
    "chunks that were not closed": (6, lambda n: mcap(ONE + chunk(message(1)) * n, closed=False)),
    "loose messages and chunks": (6, lambda n: mcap(ONE + (chunk(message(1)) + message(1)) * n)),
    "indexes of messages": (7, lambda n: indexed(n, 2)),
    "indexes of one chunk": (7, lambda n: mcap(ONE + chunk(b"") + record(7, bytes(6)) * n)),
    "indexes of chunks": (8, lambda n: indexed(2, n)),
    "attachments": (9, lambda n: mcap(ONE + record(9, bytes(40)) * n)),
    "indexes of attachments": (10, lambda n: mcap(ONE, record(10, bytes(40)) * n)),
    "statistics": (11, lambda n: mcap(ONE, record(11, bytes(50)) * n)),
    "metadata": (12, lambda n: mcap(ONE + record(12, bytes(8)) * n)),
    "indexes of metadata": (13, lambda n: mcap(ONE, record(13, bytes(20)) * n)),
    "summary offsets": (14, lambda n: mcap(ONE, record(14, bytes(17)) * n)),
    "ends of data": (15, lambda n: mcap(ONE + record(15, bytes(4)) * n)),
    "records of no kind": (0, lambda n: mcap(ONE + record(0, b"") * n)),
    "records of no kind in a chunk": (0, lambda n: mcap(chunk(ONE + record(0, b"") * n))),
    "empty records in a chunk": (0x80, lambda n: mcap(chunk(ONE + record(0x80, b"") * n))),
}


def db3(topics=0, messages=0, definitions=0, tables=0):
    """Return a database with so many rows."""
    with closing(sqlite3.connect(":memory:")) as database:
        database.executescript(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT);"
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data);"
            "CREATE TABLE message_definitions(topic_type, encoding, encoded_message_definition);"
        )
        rows = [(n, f"/t{n}", f"p{n % max(definitions, 1)}/msg/A") for n in range(max(topics, 1))]
        database.executemany("INSERT INTO topics VALUES(?, ?, ?)", rows)
        rows = [(n % max(topics, 1), n, b"\0\1\0\0" + bytes(8)) for n in range(messages)]
        database.executemany("INSERT INTO messages VALUES(NULL, ?, ?, ?)", rows)
        rows = [(f"p{n}/msg/A", "ros2msg", f"int8 a{n}") for n in range(definitions)]
        database.executemany("INSERT INTO message_definitions VALUES(?, ?, ?)", rows)
        for number in range(tables):
            database.execute(f"CREATE TABLE t{number}(a)")
        database.commit()
        return "\n".join(database.iterdump())


def restored(script, path):
    with closing(sqlite3.connect(path)) as database:
        database.executescript(script)
    return path


ROWS = {
    "topics": lambda n: db3(topics=n),
    "messages": lambda n: db3(messages=n),
    "messages of topics": lambda n: db3(topics=n, messages=n),
    "definitions": lambda n: db3(topics=n, definitions=n),
    "tables": lambda n: db3(tables=n),
}
METADATA = {
    "paths": lambda n: "".join(f"  - {i}.mcap\n" for i in range(n)),
    "one path": lambda n: "  - a.mcap\n" * n,
    "a long path": lambda n: f"  - {'a' * n}\n",
    "aliases": lambda n: "  - &a x\n" + "  - *a\n" * n,
    "more mappings": lambda n: "".join(f"  k{i}: {{}}\n" for i in range(n)),
}


def work(run):
    """Return how many calls and lines of Python are run."""
    count = 0

    def traced(*_):
        nonlocal count
        count += 1
        return traced

    before = sys.gettrace()
    sys.settrace(traced)
    try:
        run()
    finally:
        sys.settrace(before)
    return count


def shown(path):
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        for command in ("show", "check"):
            assert main([command, str(path)]) in (0, 1, 2)
    assert "IDL901" not in out.getvalue()


def read(path):
    """Find all topics by name, and read the messages of some."""
    with contextlib.suppress(RecordingError), idlc.Recording(path) as recording:
        for number, name in enumerate(recording):
            with contextlib.suppress(RecordingError):
                topic = recording[name]
                if number < 5:
                    assert sum(map(len, topic.batches())) >= 0
                    assert sum(map(len, topic.between(0, 10**18).batches())) >= 0


def assert_linear(written, folder, start):
    for run in (shown, read):
        counts = []
        for number in (start, start, 2 * start, 4 * start):  # the first fills caches
            path = written(number, folder / f"{len(counts)}")
            counts.append(work(partial(run, path)))
        _, one, two, four = counts
        assert four - two <= 2.5 * (two - one) + 2000, (run.__name__, counts[1:])
        for index in range(4):
            path = folder / f"{index}"
            (path / "metadata.yaml").unlink(missing_ok=True) if path.is_dir() else path.unlink()


@pytest.mark.parametrize("what", RECORDS)
def test_records(what, tmp_path):
    def written(number, path):
        path.write_bytes(RECORDS[what][1](number))
        return path

    assert_linear(written, tmp_path, 70)  # more than the types that are kept


@pytest.mark.parametrize("what", ROWS)
def test_rows(what, tmp_path):
    assert_linear(lambda number, path: restored(ROWS[what](number), path), tmp_path, 60)


@pytest.mark.parametrize("what", METADATA)
def test_metadata(what, tmp_path):
    def written(number, path):
        path.mkdir(exist_ok=True)
        (path / "a.mcap").write_bytes(mcap(ONE + message(1)))
        body = METADATA[what](number)
        head = "rosbag2_bagfile_information:\n  relative_file_paths:\n"
        (path / "metadata.yaml").write_text(head + body, encoding="utf-8")
        return path

    assert_linear(written, tmp_path, 60)


def test_each_kind_of_record_has_a_row():
    named = {value for name, value in vars(mcap_records).items() if name.endswith("_OP")}
    assert named | set(range(16)) <= {op for op, _ in RECORDS.values()}


@pytest.mark.parametrize("topics", [50, 100])
def test_each_of_many_topics_is_read_without_a_look_at_the_others(topics, tmp_path):
    path = tmp_path / "a.mcap"
    path.write_bytes(indexed(topics, 5))
    with open_recording(path) as container:
        every = [work(lambda t=t: list(container.messages(t, Window()))) for t in container.topics]
    assert max(every[1:]) <= 1.5 * np.median(every)


def zeros():
    """Return a recording with a chunk of zeros."""
    zeros = zstandard.ZstdCompressor(19).compress(bytes(ANY_GROWTH))
    head = pack("<QQQI", 0, 10, ANY_GROWTH, 0) + text(b"zstd") + pack("<Q", len(zeros))
    large = record(6, head + zeros)
    return mcap(ONE + large + large, closed=False)


def many_records():
    """Return a recording with a chunk of empty records."""
    return mcap(ONE + chunk(record(0x80, b"") * 3_000_000), closed=False)


#: Functions that make small files that hold much, and why these are refused.
BOMBS = {
    "zeros": (zeros, "times as much as the file"),
    "records": (many_records, "records for each of its bytes"),
}


@pytest.mark.parametrize("what", BOMBS)
def test_a_bomb_is_refused_soon(what, tmp_path):
    make, reason = BOMBS[what]
    path = tmp_path / "a.mcap"
    path.write_bytes(make())
    with pytest.raises(RecordingError, match=reason):
        open_recording(path)
