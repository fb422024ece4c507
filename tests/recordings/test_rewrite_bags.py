""".db3 files and bags with topics of other types: SQLite and rosbags find all else as it was."""

import os
import shutil
import sqlite3
from contextlib import closing
from struct import pack, unpack_from

import pytest
import yaml
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


def tables(path):
    """Return the rows of all tables, and what SQLite has written of them."""
    with closing(sqlite3.connect(path)) as database:
        schema = database.execute("SELECT * FROM sqlite_master ORDER BY name").fetchall()
        names = [name for kind, name, *_ in schema if kind == "table"]
        assert database.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        assert database.execute("PRAGMA journal_mode").fetchall() == [("delete",)]
        found = {
            name: database.execute(f"SELECT rowid, * FROM {name} ORDER BY rowid").fetchall()  # noqa: S608
            for name in names
        }
        return found, [(kind, name, text) for kind, name, _, _, text in schema]


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


def test_all_other_rows_of_a_database_stay(tmp_path):
    source = made.by_rosbags(tmp_path / "bag", MESSAGES, "db3") / "bag.db3"
    with closing(sqlite3.connect(source)) as database, database:
        database.execute("CREATE TABLE mine(a, b BLOB DEFAULT (randomblob(9)))")
        database.execute("INSERT INTO mine VALUES('x', x'00ff')")
        database.execute("DELETE FROM messages WHERE rowid % 7 = 0")
    rewrite(str(source), str(tmp_path / "new.db3"), {"/imu": JOINTS})
    (old, schema), (new, new_schema) = tables(source), tables(tmp_path / "new.db3")
    assert new_schema == schema
    (imu,) = (row[1] for row in old["topics"] if "/imu" in row)
    for name in old.keys() - {"messages", "topics", "message_definitions"}:
        assert new[name] == old[name]
    expected = [
        tuple(MESSAGES[1].data if imu == row[2] and value == row[-1] else value for value in row)
        for row in old["messages"]
    ]
    assert new["messages"] == expected
    types = {made.IMU: JOINTS.type, made.STORE.hash_rihs01(made.IMU): JOINTS.type_hash}
    assert new["topics"] == [
        tuple(types.get(value, value) for value in row) for row in old["topics"]
    ]
    definitions = [row for row in old["message_definitions"] if made.IMU not in row]
    assert new["message_definitions"] == definitions


def test_a_definition_stays_while_a_topic_has_the_type(tmp_path):
    found = [*MESSAGES, *(one._replace(topic="/other") for one in MESSAGES if one.topic == "/imu")]
    source = made.by_rosbags(tmp_path / "bag", found, "db3") / "bag.db3"
    rewrite(str(source), str(tmp_path / "a.db3"), {"/imu": NEW})
    assert {made.IMU, NEW.type} < {
        row[2] for row in tables(tmp_path / "a.db3")[0]["message_definitions"]
    }
    rewrite(str(source), str(tmp_path / "b.db3"), {"/imu": NEW, "/other": NEW})
    kinds = [row[2] for row in tables(tmp_path / "b.db3")[0]["message_definitions"]]
    assert sorted(kinds) == sorted([made.JOINTS, made.IMAGE, NEW.type])
    changed = NEW._replace(type=made.IMU)
    for conversions, why in (
        ({"/imu": changed}, "`/other` keeps the old one"),
        ({"/imu": changed, "/other": changed._replace(definition="int8 a\n")}, "not two"),
    ):
        with pytest.raises(RecordingError, match=why):
            rewrite(str(source), str(tmp_path / "c.db3"), conversions)
    rewrite(str(source), str(tmp_path / "c.db3"), {"/imu": changed, "/other": changed})
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.db3", "b.db3", "bag", "c.db3"]


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
            target = tmp_path / f"{index}.db3"
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
            rows = tables(target)[0]
            assert [number(row[-1]) for row in rows["messages"]] == [2 * one for one in expected]
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
            rewrite(str(path), str(tmp_path / "b.db3"), {})
    assert not (tmp_path / "b.db3").exists()


@pytest.mark.parametrize("what", ["change", "lock"])
def test_a_database_that_is_written_meanwhile_is_an_error(what, tmp_path, monkeypatch):
    monkeypatch.setattr("idlc.recordings.containers.db3.PATIENCE", 0.01)
    monkeypatch.setattr("idlc.recordings.containers.db3.PAGES", 5)
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
            rewrite(str(path), str(tmp_path / "b.db3"), {}, progress)
    assert not (tmp_path / "b.db3").exists()


def test_computed_indexes_and_defaults_are_not_computed(tmp_path):
    for number, (statement, why) in enumerate(
        [
            ("CREATE INDEX i ON messages(hex(data))", "computed"),
            ("CREATE INDEX i ON messages(data) WHERE length(data) > 3", "computed"),
            ("CREATE INDEX i ON messages(timestamp)", None),
            ("ALTER TABLE message_definitions ADD COLUMN x DEFAULT (1)", None),
        ]
    ):
        path, target = tmp_path / f"{number}.db3", tmp_path / f"{number}-new.db3"
        with closing(create(path)) as database:
            database.execute("UPDATE topics SET type = 'x/msg/Y'")
            database.execute(statement.replace("DEFAULT (1)", ""))
        if why:
            with pytest.raises(RecordingError, match=why):
                rewrite(str(path), str(target), {"/x": NEW})
            assert not target.exists()
        else:
            rewrite(str(path), str(target), {"/x": NEW})
            assert tables(target)[0]["message_definitions"][-1][1] == NEW.type


def test_databases_of_humble_have_no_definitions_to_change(tmp_path):
    path = tmp_path / "a.db3"
    with closing(create(path)) as database:
        database.execute("DROP TABLE message_definitions")
        database.execute("ALTER TABLE topics DROP COLUMN type_description_hash")
    rewrite(str(path), str(tmp_path / "b.db3"), {"/x": NEW})
    assert tables(tmp_path / "b.db3")[0]["topics"] == [(1, 1, "/x", NEW.type, "cdr")]


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


@pytest.mark.parametrize("name", ["b.mcap.zstd", "pipe"])
def test_folders_with_what_cannot_be_rewritten_are_an_error(name, tmp_path):
    source = tmp_path / "source"
    source.mkdir()
    made.by_mcap(source / "a.mcap", MESSAGES, "")
    if name == "pipe":
        os.mkfifo(source / name)
    else:
        (source / name).write_bytes(b"\x28\xb5\x2f\xfd")
    with pytest.raises(RecordingError, match=name):
        rewrite(str(source), str(tmp_path / "target"), {})
    assert list(tmp_path.iterdir()) == [source]


def test_a_hot_journal_is_an_error(tmp_path):
    with pytest.raises(RecordingError, match="its writer stopped within a transaction"):
        rewrite(str(hot(tmp_path)), str(tmp_path / "b.db3"), {"/x": NEW})
    assert not (tmp_path / "b.db3").exists()
