""".db3 files and bags with topics of other types: SQLite and rosbags find all else as it was."""

import os
import shutil
import sqlite3
from contextlib import closing, suppress
from struct import pack, unpack_from

import pytest
import yaml
import zstandard
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

import idlc
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.rewrite import Conversion, rewrite
from tests.recordings.test_db3_states import JOURNALS, copied, create, hot, steps
from tests.support import recordings as made

MESSAGES = made.messages(60)
JOINTS = Conversion(
    *(made.JOINTS, "ros2msg", made.definition(made.JOINTS), made.STORE.hash_rihs01(made.JOINTS)),
    lambda raws, _: [MESSAGES[1].data] * len(raws),
)
NEW = Conversion("new_msgs/msg/New", "ros2msg", "float64 data\n", "RIHS01_new")


def content(path):
    """Return what the public library reads of an MCAP file."""
    with path.open("rb") as file:
        reader = make_reader(file)
        return [
            (schema.name, schema.data.decode(), channel, message.log_time, message.data)
            for schema, channel, message in reader.iter_messages(log_time_order=False)
        ]


@pytest.mark.parametrize("storage", ["db3", "mcap"])
@pytest.mark.parametrize("compression", ["", "message"])
def test_bags_as_rosbags_reads_them(storage, compression, tmp_path):
    source = made.by_rosbags(tmp_path / "source", MESSAGES, storage, compression)
    (source / "notes.txt").write_text("mine\n", encoding="utf-8")
    (source / "folder").mkdir()
    (source / "folder" / "link").symlink_to("../notes.txt")
    before = {path: path.read_bytes() for path in source.rglob("*.*")}
    fate = rewrite(str(source), str(tmp_path / "target"), {"/imu": JOINTS}).topics
    assert {path: path.read_bytes() for path in source.rglob("*.*")} == before
    assert fate["/imu"].converted
    assert [one.messages for one in fate.values()] == [20, 20, 20]
    with AnyReader([source]) as old, AnyReader([tmp_path / "target"]) as new:
        kinds = {one.topic: one for one in new.connections}
        for one in old.connections:
            now = kinds[one.topic]
            expected = JOINTS.type if one.topic == "/imu" else one.msgtype
            assert (now.msgtype, now.msgcount) == (expected, one.msgcount)
            assert now.digest == made.STORE.hash_rihs01(expected)
        for (was, time, data), (now, new_time, new_data) in zip(
            old.messages(), new.messages(), strict=True
        ):
            assert (now.topic, new_time) == (was.topic, time)
            assert new_data == (MESSAGES[1].data if now.topic == "/imu" else data)
            new.deserialize(new_data, now.msgtype)
    with idlc.Recording(tmp_path / "target") as recording:
        assert recording.notes == ()
        assert recording["/imu"].topic.hash == JOINTS.type_hash
        assert [topic.to_arrow().num_rows for topic in recording.values()] == [20, 20, 20]
    assert (tmp_path / "target/folder/link").read_text(encoding="utf-8") == "mine\n"
    old, new = (
        yaml.safe_load((folder / "metadata.yaml").read_bytes())["rosbag2_bagfile_information"]
        for folder in (source, tmp_path / "target")
    )
    for topic in old["topics_with_message_count"]:
        if topic["topic_metadata"]["name"] == "/imu":
            topic["topic_metadata"]["type"] = JOINTS.type
            topic["topic_metadata"]["type_description_hash"] = JOINTS.type_hash
    if storage == "db3":
        name = {"path": "source.mcap"}
        old |= {"storage_identifier": "mcap", "relative_file_paths": ["source.mcap"]}
        old |= {"compression_format": "", "compression_mode": ""}
        old["files"] = [{**file, **name} for file in old["files"]]
    assert new == old
    assert sorted(path.name for path in tmp_path.iterdir()) == ["source", "target"]


def test_split_bags_keep_their_files(tmp_path):
    source = tmp_path / "source"
    source.mkdir()
    halves = MESSAGES[:30], MESSAGES[30:]
    for number, half in enumerate(halves):
        made.by_mcap(source / f"bag_{number}.mcap", half, "zstd")
    rewrite(str(source), str(tmp_path / "target"), {"/imu": JOINTS})
    with idlc.Recording(tmp_path / "target") as recording:
        assert recording["/imu"].to_arrow().num_rows == 20
        assert recording["/imu"].topic.type == JOINTS.type
    assert sorted(path.name for path in (tmp_path / "target").iterdir()) == [
        "bag_0.mcap",
        "bag_1.mcap",
    ]


def test_a_database_becomes_a_file_with_all_that_rosbag2_reads(tmp_path):
    """Order, times, profiles, hashes, definitions and metadata."""
    source = made.by_rosbags(tmp_path / "bag", MESSAGES, "db3") / "bag.db3"
    qos = "- history: 1\n  depth: 7\n"
    metadata = "version: 9\nstorage_identifier: sqlite3\nrelative_file_paths:\n  - bag.db3\n"
    with closing(sqlite3.connect(source)) as database, database:
        database.execute("UPDATE topics SET offered_qos_profiles = ?", (qos,))
        database.execute("DELETE FROM metadata")
        database.execute("INSERT INTO metadata VALUES(1, 9, ?)", (metadata,))
        database.execute("DELETE FROM messages WHERE rowid % 7 = 0")
        query = "SELECT t.name, timestamp, data FROM messages JOIN topics t ON t.id = topic_id"
        rows = database.execute(f"{query} ORDER BY messages.id").fetchall()
    rewrite(str(source), str(tmp_path / "new.mcap"), {"/imu": JOINTS})
    for row, (name, text, channel, time, data) in zip(
        rows, content(tmp_path / "new.mcap"), strict=True
    ):
        is_new = row[0] == "/imu"
        kind = JOINTS.type if is_new else {"/joints": made.JOINTS}.get(row[0], made.IMAGE)
        assert (channel.topic, time, name) == (row[0], row[1], kind)
        assert data == (MESSAGES[1].data if is_new else row[2])
        assert text == JOINTS.definition if is_new else text.strip()
        assert channel.metadata["offered_qos_profiles"] == qos
        assert channel.metadata["topic_type_hash"] == made.STORE.hash_rihs01(kind)
    with (tmp_path / "new.mcap").open("rb") as file:
        (record,) = make_reader(file).iter_metadata()
    expected = metadata.replace("sqlite3", "mcap").replace(".db3", ".mcap")
    assert (record.name, record.metadata) == ("rosbag2", {"serialized_metadata": expected})


def test_a_time_that_no_mcap_file_has_is_an_error(tmp_path):
    with closing(create(tmp_path / "a.db3")) as database, database:
        database.execute("UPDATE messages SET timestamp = -1 WHERE rowid = 3")
    with pytest.raises(RecordingError, match="before 1970"):
        rewrite(str(tmp_path / "a.db3"), str(tmp_path / "b.mcap"), {})
    assert not (tmp_path / "b.mcap").exists()


@pytest.mark.parametrize(
    ("column", "value"), [("timestamp", "x"), ("data", "x"), ("data", b"\x28\xb5\x2f\xfd")]
)
def test_damaged_rows_are_left_out(column, value, tmp_path):
    with closing(create(tmp_path / "a.db3")) as database, database:
        change = "UPDATE messages SET timestamp = ?", "UPDATE messages SET data = ?"
        database.execute(f"{change[column == 'data']} WHERE rowid = 3", (value,))
        query = "SELECT timestamp, data FROM messages WHERE rowid != 3 ORDER BY timestamp"
        rows = database.execute(query).fetchall()
    with pytest.raises(RecordingError, match="row 3"):
        rewrite(str(tmp_path / "a.db3"), str(tmp_path / "b.mcap"), {}, strict=True)
    (damage,) = rewrite(str(tmp_path / "a.db3"), str(tmp_path / "b.mcap"), {}).damage
    assert damage.messages == 1
    assert damage.problem.startswith("row 3")
    assert [(each[-2], each[-1]) for each in content(tmp_path / "b.mcap")] == rows


@pytest.mark.parametrize("journal", JOURNALS)
def test_a_database_in_any_state_its_writer_left_it_in(journal, tmp_path):
    """As SQLite reads it, with what only its log has; or the error of reading it."""
    refused = whole = 0
    double = NEW._replace(
        convert=lambda raws, _: [pack("<4sd", b"\0\1\0\0", 2 * number(raw)) for raw in raws]
    )
    with closing(create(tmp_path / "a.db3", journal=journal)) as database:
        for index, _ in enumerate(steps(database)):
            mine = copied(tmp_path / "a.db3", tmp_path / str(index))
            target = tmp_path / f"{index}.mcap"
            try:
                with idlc.Recording(mine) as recording:
                    expected = recording["/x"].to_columns()["data"].tolist()
            except RecordingError as error:
                with pytest.raises(RecordingError, match=error.message.split("`")[-1]):
                    rewrite(str(mine), str(target), {"/x": double})
                assert not target.exists()
                refused += 1
                continue
            rewrite(str(mine), str(target), {"/x": double})
            assert [number(row[-1]) for row in content(target)] == [2 * one for one in expected]
            whole += 1
    assert whole
    assert refused or journal == "WAL"
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def number(raw):
    return unpack_from("<d", raw, 4)[0]


def test_a_database_that_its_writer_has_locked_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setattr("idlc.recordings.containers.db3.PATIENCE", 0.01)
    path = tmp_path / "a.db3"
    with closing(create(path)) as database:
        database.execute("BEGIN EXCLUSIVE")
        with pytest.raises(RecordingError, match="is locked by the program"):
            rewrite(str(path), str(tmp_path / "b.mcap"), {})
    assert not (tmp_path / "b.mcap").exists()


@pytest.mark.parametrize("what", ["change", "lock"])
def test_a_database_that_is_written_meanwhile_is_an_error(what, tmp_path, monkeypatch):
    monkeypatch.setattr("idlc.recordings.containers.db3.PATIENCE", 0.01)
    monkeypatch.setattr("idlc.recordings.containers.db3.GROUP", 100)
    path = tmp_path / "a.db3"
    with closing(create(path)) as database:

        def progress(*_):
            if not database.in_transaction:
                database.execute("BEGIN EXCLUSIVE")
                database.execute("UPDATE messages SET timestamp = timestamp + 1")
                if what == "change":
                    database.execute("COMMIT")

        why = "was changed while" if what == "change" else "is locked by"
        with pytest.raises(RecordingError, match=why):
            rewrite(str(path), str(tmp_path / "b.mcap"), {}, progress)
    assert not (tmp_path / "b.mcap").exists()


def test_databases_of_humble_get_definitions(tmp_path):
    path = tmp_path / "a.db3"
    with closing(create(path)) as database:
        database.execute("DROP TABLE message_definitions")
        database.execute("ALTER TABLE topics DROP COLUMN type_description_hash")
    rewrite(str(path), str(tmp_path / "b.mcap"), {"/x": NEW})
    with idlc.Recording(tmp_path / "b.mcap") as recording:
        (topic,) = recording.topics
        assert (topic.type, topic.hash) == (NEW.type, NEW.type_hash)
        assert topic.schema.text == NEW.definition


def test_metadata_keeps_its_text_but_for_the_types(tmp_path):
    source = tmp_path / "source"
    source.mkdir()
    made.by_mcap(source / "a.mcap", MESSAGES, "")
    text = (
        "# ünïcode 𝄞\nrosbag2_bagfile_information:\n  topics_with_message_count:\n"
        "    - topic_metadata: {name: /imu, type: 'sensor_msgs/msg/Imu', "
        'type_description_hash: "x"}\n'
        "    - topic_metadata:\n        name: /joints\n        type: sensor_msgs/msg/JointState\n"
        "    - topic_metadata:\n        type_description_hash:\n        type: a  # b\n"
        "        name: /camera/image\n"
    )
    (source / "metadata.yaml").write_text(text, encoding="utf-8")
    rewrite(str(source), str(tmp_path / "new"), {"/imu": NEW, "/camera/image": NEW})
    expected = text.replace("'sensor_msgs/msg/Imu'", NEW.type).replace('"x"', NEW.type_hash)
    expected = expected.replace("hash:\n", f"hash: {NEW.type_hash}\n").replace(
        "type: a ", f"type: {NEW.type} "
    )
    assert (tmp_path / "new/metadata.yaml").read_text(encoding="utf-8") == expected
    (source / "metadata.yaml").write_text(
        text.replace("type: 'sensor_msgs/msg/Imu'", "type: &a 'x'").replace(
            "type: a ", "type: *a "
        ),
        encoding="utf-8",
    )
    with pytest.raises(RecordingError, match=r"types in `.*` cannot be changed"):
        rewrite(str(source), str(tmp_path / "other"), {"/imu": NEW})
    for broken in (b"{", b"\xff", b"- a\n", b"x" * (9 << 20)):
        shutil.rmtree(tmp_path / "new")
        (source / "metadata.yaml").write_bytes(broken)
        rewrite(str(source), str(tmp_path / "new"), {"/imu": NEW})
        assert (tmp_path / "new/metadata.yaml").read_bytes() == broken


def test_a_folder_with_what_cannot_be_rewritten_is_an_error(tmp_path):
    source = tmp_path / "source"
    source.mkdir()
    made.by_mcap(source / "a.mcap", MESSAGES, "")
    os.mkfifo(source / "pipe")
    with pytest.raises(RecordingError, match="pipe"):
        rewrite(str(source), str(tmp_path / "target"), {})
    assert list(tmp_path.iterdir()) == [source]


@pytest.mark.parametrize("suffix", ["mcap", "db3"])
def test_files_that_are_compressed_as_a_whole_become_plain_ones(suffix, tmp_path):
    source = made.by_rosbags(tmp_path / "bag", MESSAGES, suffix)
    (plain,) = source.glob(f"*.{suffix}")
    rewrite(str(plain), str(tmp_path / "expected.mcap"), {})
    packed = source / f"{plain.name}.zstd"
    packed.write_bytes(zstandard.ZstdCompressor().compress(plain.read_bytes()))
    plain.unlink()
    metadata = source / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace(plain.name, packed.name))
    assert rewrite(str(source), str(tmp_path / "new"), {}).damage == ()
    (written,) = (tmp_path / "new").glob("*.mcap*")
    assert content(written) == content(tmp_path / "expected.mcap")
    text = (tmp_path / "new/metadata.yaml").read_text()
    assert f"- {written.name}" in text.replace("'", "")
    assert "zstd" not in text
    (source / packed.name).write_bytes(packed.read_bytes()[:-9])
    with pytest.raises(RecordingError, match=packed.name):
        rewrite(str(source), str(tmp_path / "strict"), {}, strict=True)
    (tmp_path / "damaged").parent.mkdir(exist_ok=True)
    with suppress(RecordingError):
        assert packed.name in str(rewrite(str(source), str(tmp_path / "damaged"), {}).damage)


def test_a_hot_journal_is_an_error(tmp_path):
    with pytest.raises(RecordingError, match="its writer stopped within a transaction"):
        rewrite(str(hot(tmp_path)), str(tmp_path / "b.mcap"), {"/x": NEW})
    assert not (tmp_path / "b.mcap").exists()
