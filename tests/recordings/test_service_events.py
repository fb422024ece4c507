"""A recording of the real recorder, with events of services, whose definitions are of two kinds.

`service_events/` is what `ros2 bag record` of Jazzy wrote of a package that rosidl had
built: the definition of one service's events has an empty .msg text and the IDL of that type.
"""

import sqlite3
from contextlib import closing

import pytest
import zstandard
from mcap.reader import make_reader
from mcap.writer import Writer

import idlc
from idlc.cli.main import main
from idlc.recordings.containers.source import RecordingError
from tests.support.paths import ROOT

FOLDER = ROOT / "tests/recordings/service_events"
BAG = FOLDER / "service_events.mcap"
ASK = "/ask/_service_event"
EMPTY_ONE = "=" * 80 + "\nMSG: kit_msgs/Branch\n\n"


@pytest.fixture
def said(capsys):
    """Return a function that runs a command, and returns its status and what it says."""

    def run(*words):
        status = main([str(word) for word in words])
        return status, "".join(capsys.readouterr())

    return run


def rewritten(path, text=lambda text: text, data=lambda data: data, hashes=True):
    """Write the recording once more, with other definitions or messages."""
    with BAG.open("rb") as source, path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channels = {}
        for schema, channel, message in make_reader(source).iter_messages(log_time_order=False):
            if channel.id not in channels:
                written = text(schema.data.decode()).encode()
                number = writer.register_schema(schema.name, schema.encoding, written)
                metadata = channel.metadata if hashes else {}
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, number, metadata
                )
            time, content = message.log_time, data(message.data)
            writer.add_message(channels[channel.id], time, content, message.publish_time)
        writer.finish()
    return path


def without_idl(text):
    """Leave out the IDL that follows an empty definition."""
    before, empty, after = text.partition(EMPTY_ONE)
    return before + empty + after[after.index("=" * 80, 80) :] if empty else text


def test_the_same_interfaces_break_nothing(said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for levels in ("", 'levels = ["hash"]\n'):
        (tmp_path / "pyproject.toml").write_text(f"[tool.idlc.breaking]\n{levels}")
        words = ["breaking", FOLDER / "kit_msgs", "--package", "kit_msgs", "--against", BAG]
        status, text = said(*words)
        assert status == 0, text
        assert "no breaking changes" in text


def test_check_gen_and_columns_of_all_topics(said, tmp_path):
    status, text = said("check", BAG)
    assert status == 0, text
    assert "IDL653" not in text
    assert "IDL654" not in text
    status, text = said("gen", BAG, "-o", tmp_path / "out")
    assert status == 0, text
    status, text = said("columns", BAG, "-o", f"{tmp_path}/columns/", "-I", FOLDER)
    assert status == 0, text
    assert len(list((tmp_path / "columns").iterdir())) == 14
    with idlc.Recording(BAG) as recording:
        assert all(event.info.event_type in range(4) for _, event in recording[ASK])
        assert recording["/empty"].to_arrow().num_rows == 15


def test_a_definition_of_another_hash_gives_way_to_the_known_type(said, tmp_path):
    path = rewritten(tmp_path / "a.mcap", without_idl)
    with idlc.Recording(path, include=[str(FOLDER)]) as recording, idlc.Recording(BAG) as sound:
        with pytest.warns(
            UserWarning, match="the recorded hash does not match the definition of `kit"
        ):
            found = recording[ASK].to_arrow()
        assert found.equals(sound[ASK].to_arrow())
    words = [
        "breaking",
        FOLDER / "kit_msgs",
        "--package",
        "kit_msgs",
        "--against",
        path,
        "-I",
        FOLDER,
    ]
    status, text = said(*words)
    assert status == 0, text
    assert "no breaking changes" in text
    _, text = said("check", path, "-I", FOLDER)
    assert "IDL654" in text
    assert "idlc uses the local type, which has the recorded hash" in text


def test_an_empty_definition_within_another_gives_way_to_the_known_type(said, tmp_path):
    path = rewritten(tmp_path / "a.mcap", without_idl, hashes=False)
    with idlc.Recording(path, include=[str(FOLDER)]) as recording, idlc.Recording(BAG) as sound:
        with pytest.warns(UserWarning, match="the recording does not define `kit_msgs/msg/Branch`"):
            found = recording[ASK].to_arrow()
        assert found.equals(sound[ASK].to_arrow())


def test_a_definition_of_another_hash_is_told_where_nothing_else_is_known(said, tmp_path):
    path = rewritten(tmp_path / "a.mcap", without_idl)
    _, text = said("check", path)
    assert "IDL654" in text
    assert "add `-I DIR`, where DIR contains the publisher's files" in text


def test_an_empty_definition_is_that_of_a_message_without_fields(said, tmp_path):
    """Where its hash says so, or, after `ros2 bag convert` left that out, what is known here."""
    with idlc.Recording(BAG) as recording:
        assert recording["/empty"].to_arrow().column_names == ["log_time", "publish_time"]
    path = rewritten(tmp_path / "a.mcap", hashes=False)
    with idlc.Recording(path, include=[str(FOLDER)]) as recording:
        assert recording["/empty"].to_arrow().column_names == ["log_time", "publish_time"]
    _, text = said("show", path, "/empty")
    assert "idlc does not read `/empty`: the recording does not define `kit_msgs/msg/Empty`" in text
    assert "add `-I DIR`, where DIR contains the package's sources" in text
    no_definition = pytest.raises(RecordingError, match="the recording does not define")
    with idlc.Recording(path) as recording, no_definition:
        recording["/empty"].to_arrow()
    path = rewritten(tmp_path / "b.mcap", lambda text: "" if "float" in text else text)
    with idlc.Recording(path) as recording:
        assert recording["/empty"].to_arrow().num_rows == 15
        with pytest.raises(RecordingError, match="the recording does not define"):
            recording["/plain"].to_arrow()


@pytest.mark.parametrize("storage", ["mcap", "db3"])
@pytest.mark.parametrize("metadata", [True, False])
def test_messages_that_are_compressed_one_by_one(storage, metadata, tmp_path):
    compressor = zstandard.ZstdCompressor()
    bag = tmp_path / "bag"
    bag.mkdir()
    path = rewritten(bag / "bag_0.mcap", data=compressor.compress)
    if storage == "db3":
        path = as_db3(path, bag / "bag_0.db3")
    if metadata:
        text = f"relative_file_paths: [{path.name}], compression_mode: MESSAGE"
        text = f"rosbag2_bagfile_information: {{{text}, compression_format: zstd}}"
        (bag / "metadata.yaml").write_text(text, encoding="utf-8")
    with idlc.Recording(bag) as recording, idlc.Recording(BAG) as sound:
        for name in recording:
            if name != "/count/_action/feedback":
                some = [recording[name].between("0.1"), recording[name]]
                wanted = [sound[name].between("0.1"), sound[name]]
                for one, other in zip(some, wanted, strict=True):
                    found, expected = one.to_arrow(), other.to_arrow()
                    assert found.drop(["publish_time"]).equals(expected.drop(["publish_time"]))


def as_db3(path, target):
    """Write a recording as rosbag2's other storage does, and remove it."""
    with closing(sqlite3.connect(target)) as database, path.open("rb") as file, database:
        database.executescript(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT,"
            " serialization_format TEXT, type_description_hash TEXT);"
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER,"
            " data BLOB);"
            "CREATE TABLE message_definitions(topic_type TEXT, encoding TEXT,"
            " encoded_message_definition TEXT, type_description_hash TEXT);"
        )
        for schema, channel, one in make_reader(file).iter_messages(log_time_order=False):
            row = (channel.topic, schema.name, "cdr", channel.metadata["topic_type_hash"])
            database.execute(
                "INSERT OR IGNORE INTO topics VALUES(?, ?, ?, ?, ?)", (channel.id, *row)
            )
            row = (channel.id, one.log_time, one.data)
            database.execute("INSERT INTO messages VALUES(NULL, ?, ?, ?)", row)
            row = (schema.name, schema.encoding, schema.data.decode(), "")
            database.execute("INSERT INTO message_definitions VALUES(?, ?, ?, ?)", row)
    path.unlink()
    return target
