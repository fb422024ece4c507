"""Recordings of other people: names, hints and values that lead on."""

import csv
import io
import json
import struct

import pytest
from mcap.writer import Writer

import idlc
from idlc.cli.main import main
from idlc.recordings.containers.source import RecordingError

START, HEAD = 10**18, b"\0\1\0\0"
FLOATS = "float64[] l\nfloat64 x\n"


def recording(path, topics, encoding="cdr", definition="int32 v\n", name="demo_msgs/msg/P"):
    """Write a recording with messages of two seconds in each topic."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="test")
        schema = writer.register_schema(name, "ros2msg", definition.encode()) if definition else 0
        for topic, body in topics.items():
            channel = writer.register_channel(topic, encoding, schema)
            for second in range(3):
                time = START + second * 10**9
                writer.add_message(channel, time, HEAD + body, time)
        writer.finish()
    return str(path)


def test_topics_of_similar_names_are_written_to_different_files(tmp_path, capsys):
    topics = ["/a/b", "a/b", "/A/b", "/a.b", "/a/b-2"]
    bodies = {topic: struct.pack("<i", number) for number, topic in enumerate(topics)}
    path = recording(tmp_path / "a.mcap", bodies)
    for out in ("out/", "out2/x_{topic}.csv"):
        assert main(["columns", path, "-o", f"{tmp_path}/{out}", "--format", "csv"]) == 0
        files = sorted((tmp_path / out.partition("/")[0]).iterdir())
        texts = {file.name.casefold(): file.read_text(encoding="utf-8") for file in files}
        assert len(texts) == len(topics)
        values = {text.splitlines()[1].rpartition(",")[2] for text in texts.values()}
        assert values == set(map(str, range(len(topics))))
    assert main(["columns", path, "-o", str(tmp_path / "one.csv")]) == 2
    assert "cannot all go to" in capsys.readouterr().err


def test_lists_in_csv_are_json(tmp_path, capsys):
    numbers = [1.5, float("nan"), float("inf"), float("-inf")]
    body = struct.pack("<I4x4dd", 4, *numbers, float("nan"))
    path = recording(tmp_path / "a.mcap", {"/l": body}, definition=FLOATS)
    assert main(["columns", path, "/l", "--format", "csv"]) == 0
    row = next(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    values = json.loads(row["l"], parse_constant=pytest.fail)
    assert values == [1.5, None, None, None]


@pytest.mark.parametrize(
    ("encoding", "name", "definition"),
    [("json", "J", "x"), ("ros1", "demo_msgs/X", "x"), ("cdr", "a.b.C", "int32 v\n")],
)
def test_no_folder_is_asked_for_where_none_can_help(encoding, name, definition, tmp_path, capsys):
    path = recording(tmp_path / "a.mcap", {"/x": b"{}"}, encoding, definition, name)
    for command in (["check"], ["upgrade", "-o", str(tmp_path / "up")]):
        assert main([command[0], path, *command[1:]]) == 0
        said = "".join(capsys.readouterr())
        assert "idlc does not read `/x`" in said
        assert "-I" not in said
        assert "skips" not in said


def test_damage_is_said_once_and_by_its_code(tmp_path, capsys, recwarn):
    path = recording(tmp_path / "a.mcap", {"/x": struct.pack("<i", 1)})
    data = (tmp_path / "a.mcap").read_bytes()
    (tmp_path / "a.mcap").write_bytes(data[: len(data) // 3] + bytes(400))
    main(["columns", path, "/x", "--format", "csv"])
    said = capsys.readouterr().err
    assert "DamageWarning" not in said
    assert not recwarn.list
    assert "error[IDL656]" in said


def test_zeros_in_a_summary_cost_no_message(tmp_path, capsys):
    path = recording(tmp_path / "a.mcap", {"/x": struct.pack("<i", 1)})
    data = (tmp_path / "a.mcap").read_bytes()
    end = data.index(b"\x0f\x04\0\0\0\0\0\0\0") + 13
    for cut in range(end, len(data), 7):
        (tmp_path / "a.mcap").write_bytes(data[:cut] + bytes(400))
        with idlc.Recording(path) as opened:
            assert opened["/x"].to_columns()["v"].tolist() == [1, 1, 1]
            assert not opened.damage


@pytest.mark.parametrize(
    ("times", "hint"),
    [
        (("10", "20"), "give times from `0` to `2`, in seconds"),
        (("2020-01-01", None), "give times from `0` to `2`, in seconds"),
        ((10, 20), "write a text, such as `'10'`"),
    ],
)
def test_the_hint_of_a_range_is_of_the_kind_that_was_given(times, hint, tmp_path):
    path = recording(tmp_path / "a.mcap", {"/x": struct.pack("<i", 1)})
    with idlc.Recording(path) as opened, pytest.raises(RecordingError, match=hint):
        opened["/x"].between(*times)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:7447", "quic://robot:1"])
def test_an_address_is_written_without_colons(address, capsys):
    assert main(["show", address]) == 2
    assert f"write `{address.replace('://', '/')}`" in capsys.readouterr().err


@pytest.mark.parametrize("late", [1 << 63, (1 << 64) - 1])
def test_check_says_that_times_are_late(late, tmp_path, capsys):
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="test")
        schema = writer.register_schema("demo_msgs/msg/P", "ros2msg", b"int32 v\n")
        channel = writer.register_channel("/x", "cdr", schema)
        for log, publish in ((5, 5), (late, 6), (7, late)):
            writer.add_message(channel, log, HEAD + struct.pack("<i", 1), publish)
        writer.finish()
    assert main(["check", str(path)]) == 0
    assert "2 times after the year 2262" in capsys.readouterr().err
