"""What is in a recording is found, whoever wrote it and whatever it leaves out."""

import shutil
import sqlite3
import subprocess
import sys

import pytest

from idlc.recordings.container import RecordingError, open_recording
from tests.support import recordings as made

MESSAGES = made.messages()
COUNTS = dict.fromkeys(made.MAKERS, 20)

#: What the mcap library leaves out if it is told to.
LEAVES_OUT = {
    "nothing": {},
    "chunks": {"use_chunking": False},
    "statistics": {"use_statistics": False},
    "schemas": {"repeat_schemas": False},
    "channels": {"repeat_channels": False},
    "indexes": {"index_types": made.INDEX_TYPES.NONE},
    "message indexes": {"index_types": made.INDEX_TYPES.CHUNK},
    "chunk indexes": {"index_types": made.INDEX_TYPES.MESSAGE},
}


def topics(path, **options):
    with open_recording(path, **options) as container:
        return {topic.name: topic for topic in container.topics}


def expected(found, hashes=True):
    assert {name: topic.count for name, topic in found.items()} == COUNTS
    assert {name: topic.type for name, topic in found.items()} == {
        topic: kind for topic, (kind, _) in made.MAKERS.items()
    }
    for topic in found.values():
        assert topic.encoding == "cdr"
        assert topic.hash == (made.STORE.hash_rihs01(topic.type) if hashes else None)
        assert topic.schema.name == topic.type
        assert topic.schema.encoding == "ros2msg"
        assert topic.schema.text == made.definition(topic.type)


@pytest.mark.parametrize("left_out", LEAVES_OUT)
@pytest.mark.parametrize("compression", made.COMPRESSIONS)
@pytest.mark.parametrize("index", [True, False])
def test_mcap_files(left_out, compression, index, tmp_path):
    options = {"chunk_size": 4000, **LEAVES_OUT[left_out]}
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES, compression, **options)
    expected(topics(path, index=index, check=True))


@pytest.mark.parametrize(
    ("storage", "compression"),
    [("db3", ""), ("db3", "message"), ("mcap", ""), ("mcap", "storage")],
)
def test_bags_of_rosbags(storage, compression, tmp_path):
    bag = made.by_rosbags(tmp_path / "bag", MESSAGES, storage, compression)
    hashes = storage == "db3"  # rosbags writes none into MCAP files
    expected(topics(bag), hashes)
    (file,) = bag.glob(f"*.{storage}")
    expected(topics(file), hashes)
    (bag / "metadata.yaml").unlink()
    expected(topics(bag), hashes)


def test_a_split_bag_is_one(tmp_path):
    for number in range(3):
        part = MESSAGES[number * 20 : number * 20 + 20]
        made.by_mcap(tmp_path / f"bag_{number}.mcap", part)
    expected(topics(tmp_path))


def test_a_bag_has_the_files_that_its_metadata_names(tmp_path):
    bag = made.by_rosbags(tmp_path / "bag", MESSAGES, "mcap")
    shutil.copy(bag / "bag.mcap", bag / "other.mcap")
    with open_recording(bag) as container:
        assert container.notes == ("`other.mcap` is not named in metadata.yaml and left out",)
    expected(topics(bag), hashes=False)


@pytest.mark.parametrize("compression", made.COMPRESSIONS)
def test_a_truncated_file_is_read_to_its_last_whole_chunk_and_says_so(compression, tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES, compression, chunk_size=4000)
    whole = path.read_bytes()
    before = 0
    for size in range(8, len(whole), 997):
        path.write_bytes(whole[:size])
        with open_recording(path) as container:
            count = sum(topic.count for topic in container.topics)
            (note,) = container.notes
            assert "it was not closed: read " in note
            assert "to its last whole record" in note or count == len(MESSAGES)
        assert count >= before
        before = count
    assert before == len(MESSAGES)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"\x89MC", "is no recording"),
        (b"#ROSBAG V2.0\n", "is no recording"),
        (b"\x28\xb5\x2f\xfd....", "is no recording"),
        (b"SQLite format 3\0", "cannot be read"),
        (b"hello", "is no recording"),
    ],
)
def test_other_files_are_refused(content, message, tmp_path):
    path = tmp_path / "a.mcap"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=message):
        open_recording(path)


def test_what_is_not_there_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="No such file"):
        open_recording(tmp_path / "a.mcap")
    with pytest.raises(RecordingError, match="holds no recording"):
        open_recording(tmp_path)


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        ("CREATE VIEW v AS SELECT 1", "holds a view"),
        ("CREATE TRIGGER t AFTER INSERT ON topics BEGIN SELECT 1; END", "holds a trigger"),
        ("CREATE VIRTUAL TABLE t USING fts5(a)", "holds a virtual table"),
        ("ALTER TABLE messages ADD COLUMN a AS (zeroblob(1000000000))", "are computed"),
        ("DROP TABLE messages", "no table of messages"),
        ("UPDATE topics SET name = x'00'", "values of other types"),
        ("UPDATE topics SET name = CAST(x'ff' AS TEXT)", "cannot be read"),
    ],
)
def test_a_database_with_more_than_tables_is_refused(statement, message, tmp_path):
    bag = made.by_rosbags(tmp_path / "bag", MESSAGES, "db3")
    (path,) = bag.glob("*.db3")
    with sqlite3.connect(path) as database:
        database.execute(statement)
    database.close()
    with pytest.raises(RecordingError, match=message):
        open_recording(path)


def test_reading_leaves_nothing_beside_a_database(tmp_path):
    bag = made.by_rosbags(tmp_path / "bag", MESSAGES, "db3")
    before = sorted(bag.iterdir())
    expected(topics(bag))
    assert sorted(bag.iterdir()) == before


def test_what_is_in_a_file_is_read_with_the_standard_library(tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES)
    code = (
        "import sys; from idlc.recordings.container import open_recording\n"
        f"assert len(open_recording({str(path)!r}).topics) == 3\n"
        "print(*({'numpy', 'zstandard', 'lz4', 'msgspec', 'pyarrow'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
