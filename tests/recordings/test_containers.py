"""What is in a recording is found, whoever wrote it and whatever it leaves out."""

import shutil
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
import zstandard

from idlc.recordings.containers.container import open_recording
from idlc.recordings.containers.source import RecordingError
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
        assert container.notes == ("idlc skips `other.mcap`: metadata.yaml does not list it",)
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
        (b"\x89MC", "is not an MCAP or .db3 recording"),
        (b"#ROSBAG V2.0\n", "is a recording of ROS 1"),
        (zstandard.compress(b"...."), "is not an MCAP or .db3 recording"),
        (b"SQLite format 3\0", "cannot be read"),
        (b"hello", "is not an MCAP or .db3 recording"),
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
    with pytest.raises(RecordingError, match="contains no recording"):
        open_recording(tmp_path)


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        ("CREATE VIEW v AS SELECT 1", "contains a view"),
        ("CREATE TRIGGER t AFTER INSERT ON topics BEGIN SELECT 1; END", "contains a trigger"),
        ("CREATE VIRTUAL TABLE t USING fts5(a)", "contains a virtual table"),
        ("ALTER TABLE messages ADD COLUMN a AS (zeroblob(1000000000))", "are computed"),
        ("ALTER TABLE messages ADD COLUMN RowId INTEGER", "is called rowid"),
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


def test_what_is_in_a_file_is_read_without_heavy_modules(tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES)
    code = (
        "import sys; from idlc.recordings.containers.container import open_recording\n"
        f"assert len(open_recording({str(path)!r}).topics) == 3\n"
        "print(*({'dataclasses', 'lz4', 'numpy', 'pyarrow', 'zstandard'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def bag_of(folder, names):
    """Write one message to each of some files of a folder."""
    folder.mkdir()
    for number, name in enumerate(names):
        made.by_mcap(folder / name, MESSAGES[number : number + 1])


NAMES = [f"a_long_name_of_a_file_of_this_day_{number}.mcap" for number in range(4)]
ODD = [
    "a b, c.mcap",
    "x#y.mcap",
    "\u00fcn\u00ef.mcap",
    "tab\tq.mcap",
    "co: lon.mcap",
    "'q\".mcap",
    "~.mcap",
]


def information(names, **more):
    return {"rosbag2_bagfile_information": {"relative_file_paths": names, **more}}


@pytest.mark.parametrize("names", [NAMES, ODD], ids=["long", "odd"])
@pytest.mark.parametrize("version", range(1, 10))
@pytest.mark.parametrize(
    "style",
    [
        {},
        {"default_flow_style": None},
        {"default_flow_style": True, "width": 20},
        {"default_style": '"', "width": 10},
        {"default_style": "'", "indent": 8},
        {"explicit_start": True, "explicit_end": True, "line_break": "\r\n"},
    ],
    ids=str,
)
def test_metadata_in_every_style_of_yaml(names, version, style, tmp_path):
    bag_of(tmp_path / "bag", [*names, "other.mcap"])
    there = [f"bag/{name}" for name in names] if version < 4 else names
    meta = information(there, version=version, files=[{"path": one} for one in there])
    path = tmp_path / "bag" / "metadata.yaml"
    path.write_bytes(yaml.dump(meta, **style).encode("utf-16" if version == 9 else "utf-8"))
    with open_recording(path.parent) as container:
        assert [Path(one.name).name for one in container.files] == names
        assert container.notes == ("idlc skips `other.mcap`: metadata.yaml does not list it",)


@pytest.mark.parametrize(
    ("text", "note"),
    [
        (yaml.dump({"shared": NAMES[:3], **information(NAMES[:3])}), "not list it"),
        ("{[\nrosbag2", "` is not YAML; idlc reads all files in the folder"),
        ("a: &a [" + "[" * 500, "nests more than 100 levels"),
        ("a: \udcff", "is not YAML"),
        ("%YAML 9.9\n---\n", ""),
        ("a: !!python/object/apply:os.system [exit]", ""),
        ("#" * (9 << 20), "larger than 8 MiB"),
        ("", ""),
        ("rosbag2_bagfile_information:\n  relative_file_paths:\n  - a.mcap\n" * 2, "`a.mcap`"),
        ("rosbag2_bagfile_information: {relative_file_paths: [{}, [], ~, 5]}", "`5`"),
        ("rosbag2_bagfile_information: {relative_file_paths: [../o.mcap, /etc/o.mcap]}", "`o.mc"),
        ("- rosbag2_bagfile_information\n", ""),
        ("&a [*a]", ""),
    ],
    ids=range(13),
)
def test_metadata_that_is_odd(text, note, tmp_path):
    bag_of(tmp_path / "bag", NAMES)
    made.by_mcap(tmp_path / "o.mcap", MESSAGES)
    path = tmp_path / "bag" / "metadata.yaml"
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    with open_recording(path.parent) as container:
        names = [Path(one.name).name for one in container.files]
        assert names == NAMES[: 3 if "shared" in text else 4]
        assert note in " ".join((*container.notes, *map(str, container.damage)))


def test_metadata_of_aliases_of_aliases_costs_nothing(tmp_path):
    """Neither by lists of lists nor by merged mappings."""
    bag_of(tmp_path / "bag", NAMES)
    levels = range(60)
    lists = "".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9 * (n > 0))}]\n" for n in levels)
    merges = "".join(
        f"m{n}: &m{n} {{<<: [{', '.join([f'*m{n - 1}'] * 9 * (n > 0))}]}}\n" for n in levels
    )
    path = tmp_path / "bag" / "metadata.yaml"
    path.write_text(lists + merges + yaml.dump(information(NAMES[:2])), encoding="utf-8")
    with open_recording(path.parent) as container:
        assert len(container.files) == 2


def test_a_name_that_is_there_twice_loses_no_file(tmp_path):
    bag_of(tmp_path / "bag", NAMES)
    text = "rosbag2_bagfile_information:\n" + "".join(
        f"  relative_file_paths: [{one}]\n" for one in NAMES[:3]
    )
    (tmp_path / "bag" / "metadata.yaml").write_text(text, encoding="utf-8")
    with open_recording(tmp_path / "bag") as container:
        assert len(container.files) == 3
