"""Values of recordings: those that other readers find, as objects, columns and tables."""

import inspect
import io
import pickle
import pydoc
import re
import subprocess
import sys
from datetime import datetime, timedelta, timezone

import numpy as np
import pyarrow as pa
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

import idlc
from idlc.cli.main import main
from idlc.recordings.containers.source import RecordingError
from tests.recordings.test_containers import LEAVES_OUT, MESSAGES
from tests.support import programs
from tests.support import recordings as made
from tests.support.paths import ROOT

VARIED = made.varied()
TOPICS = list(dict.fromkeys(one.topic for one in VARIED))
#: mcap-ros2-support takes a char for a signed number.
WRONG_ELSEWHERE = {"/Char"}


def by_rosbags(path, topic):
    with AnyReader([path], default_typestore=made.STORE) as reader:
        wanted = [one for one in reader.connections if one.topic == topic]
        return [
            (time, made.plain(reader.deserialize(raw, connection.msgtype)))
            for connection, time, raw in reader.messages(connections=wanted)
        ]


def by_mcap_ros2(path, topic):
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        found = reader.iter_decoded_messages(topics=[topic], log_time_order=False)
        return [(one.message.log_time, made.plain(one.decoded_message)) for one in found]


def agree(path, topic, wanted):
    """Compare every way of reading a topic with what another reader found."""
    with idlc.Recording(path) as recording:
        one = recording[topic]
        read = [(time, made.plain(message.to_dict())) for time, message in one.messages()]
        assert read == wanted
        columns = one.to_columns()
        rows = [{**row, "publish_time": None} for row in columns.to_list()]
        times = [{"log_time": time, "publish_time": None} for time, _ in wanted]
        if "publish_time" not in columns.keys():  # noqa: SIM118
            times = [{"log_time": time} for time, _ in wanted]
            rows = columns.to_list()
        values = [value for _, value in wanted]
        pairs = zip(times, values, strict=True)
        assert made.plain(rows) == [{**time, **value} for time, value in pairs]
        table = one.to_arrow()
        assert table.column("log_time").cast(pa.int64()).to_pylist() == [t for t, _ in wanted]
        assert made.plain(table.drop(["log_time", "publish_time"]).to_pylist()) == values
        assert one.to_reader().read_all().equals(table)


# rosbags has a hash of its own for a char
@pytest.mark.filterwarnings("ignore:.*the definition of std_msgs/msg/Char is not")
@pytest.mark.parametrize("topic", TOPICS)
def test_every_value_is_that_of_other_readers(topic, tmp_path):
    written = {
        "mcap": made.by_mcap(tmp_path / "a.mcap", VARIED, "", chunk_size=3000),
        "rosbags mcap": made.by_rosbags(tmp_path / "bag_mcap", VARIED, "mcap", "storage"),
        "rosbags db3": made.by_rosbags(tmp_path / "bag_db3", VARIED, "db3"),
    }
    wanted = by_rosbags(written["rosbags db3"], topic)
    assert len(wanted) == 5
    for path in written.values():
        agree(path, topic, wanted)
    if topic not in WRONG_ELSEWHERE:
        assert by_mcap_ros2(written["mcap"], topic) == wanted


@pytest.mark.parametrize("left_out", LEAVES_OUT)
@pytest.mark.parametrize("compression", made.COMPRESSIONS)
def test_every_way_of_writing_gives_the_same_values(left_out, compression, tmp_path):
    options = {"chunk_size": 3000, **LEAVES_OUT[left_out]}
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES, compression, **options)
    for topic in made.MAKERS:
        mine = [one for one in MESSAGES if one.topic == topic]
        values = [made.plain(made.STORE.deserialize_cdr(one.data, one.type)) for one in mine]
        agree(path, topic, list(zip([one.log_time for one in mine], values, strict=True)))


def test_a_recording_is_a_mapping_of_topics(tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES)
    with idlc.Recording(str(path)) as recording:
        assert list(recording) == list(made.MAKERS)
        assert len(recording) == 3
        assert "/imu" in recording
        assert "/nothing" not in recording
        assert "/joints        sensor_msgs/msg/JointState  20" in repr(recording)
        assert recording["/imu"].topic.count == len(list(recording["/imu"])) == 20
        with pytest.raises(KeyError, match=r"has no topic `/im` \(did you mean `/imu`\?\)"):
            recording["/im"]


def test_several_files_are_one_recording(tmp_path):
    paths = [made.by_mcap(tmp_path / f"{n}.mcap", MESSAGES[n * 30 : n * 30 + 30]) for n in range(2)]
    with idlc.Recording(paths) as recording:
        assert [t for t, _ in recording["/imu"]] == [
            one.log_time for one in MESSAGES if one.topic == "/imu"
        ]


def test_files_of_different_kinds_are_one_recording(tmp_path):
    """Their messages are kept in different ways, which shows nowhere."""
    bag = made.by_rosbags(tmp_path / "bag", MESSAGES[30:60], "db3")
    other = made.by_mcap(tmp_path / "b.mcap", MESSAGES[60:], "zstd", chunk_size=3000)
    paths = [made.by_mcap(tmp_path / "a.mcap", MESSAGES[:30]), bag, other]
    with idlc.Recording(paths) as recording, idlc.Recording(bag) as rows:
        for name, topic in recording.items():
            values = [message.to_dict() for _, message in topic]
            for columns in (topic.to_columns(), topic.to_arrow().to_pandas()):
                times = [one.log_time for one in MESSAGES if one.topic == name]
                assert np.asarray(columns["log_time"]).astype(np.int64).tolist() == times
            found = topic.to_columns().to_list()
            assert [{k: v for k, v in row.items() if k in values[0]} for row in found] == values
            time = rows[name].to_columns()["log_time"][0]
            nothing = rows[name].between(time, time)
            assert len(nothing.to_columns()) == nothing.to_arrow().num_rows == 0


@pytest.mark.parametrize("place", ["url", "fsspec file", "file object"])
def test_what_fsspec_opens_is_read(place, tmp_path):
    import fsspec

    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES, chunk_size=3000)
    opened = {
        "url": lambda: f"memory://{path.name}",
        "fsspec file": lambda: fsspec.open(f"file://{path}", "rb"),
        "file object": lambda: path.open("rb"),
    }[place]
    with fsspec.open(f"memory://{path.name}", "wb") as file:
        file.write(path.read_bytes())
    with idlc.Recording(path) as local, idlc.Recording(opened()) as recording:
        assert recording["/imu"].to_arrow().equals(local["/imu"].to_arrow())
        if place != "file object":
            parts = pickle.loads(pickle.dumps(recording["/imu"].parts(1)))
            assert len(parts) >= 5
            tables = [part.to_arrow() for part in parts]
            assert pa.concat_tables(tables).equals(local["/imu"].to_arrow())


@pytest.mark.parametrize(
    ("place", "said"),
    [
        ("memory://nothing.mcap", "`memory://nothing.mcap` cannot be read: No such file"),
        ("nosuch://a.mcap", "Protocol not known: nosuch"),
        ("https://localhost:1/a.mcap", "`https://localhost:1/a.mcap` cannot be read: "),
    ],
)
def test_what_fsspec_cannot_open_is_said(place, said, capsys):
    with pytest.raises(RecordingError, match=re.escape(said)):
        idlc.Recording(place)
    assert main(["columns", place, "-o", "a.csv"]) == 1
    assert said in capsys.readouterr().err


def test_of_a_file_object_no_more_is_read_than_is_needed(tmp_path):
    class Counted(io.FileIO):
        done = 0

        def read(self, size=-1):
            found = super().read(size)
            self.done += len(found)
            return found

    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES * 20, chunk_size=3000)
    with Counted(path) as file, idlc.Recording(file) as recording:
        opening = file.done
        first, *_ = recording["/imu"].parts(1)
        assert first.to_arrow().num_rows
        assert file.done - opening < 10_000 < path.stat().st_size // 10


def test_a_time_is_a_number_a_text_or_a_date(tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES, chunk_size=3000)
    date = datetime.fromtimestamp(made.START // made.SECOND, timezone.utc)
    starts = [
        made.START + 2 * made.SECOND,
        np.int64(made.START + 2 * made.SECOND),
        "2",
        "2s",
        "0m2.0s",
        "1700000002",
        "1700000002.0",
        "1700000002000000000",
        "2023-11-14T22:13:22",
        "2023-11-14 22:13:22Z",
        "2023-11-14T23:13:22.000000000+01:00",
        "2023-11-14T22:13:21.999999999",
        date + timedelta(seconds=2),
        (date + timedelta(seconds=2)).replace(tzinfo=None),
        timedelta(seconds=2),
        np.datetime64("2023-11-14T22:13:22", "s"),
        np.timedelta64(2, "s"),
    ]
    with idlc.Recording(path) as recording:
        topic = recording["/imu"]
        whole = [time for time, _ in topic]
        wanted = [time for time in whole if time >= made.START + 2 * made.SECOND]
        assert 0 < len(wanted) < len(whole)
        for start in starts:
            assert [time for time, _ in topic.between(start)] == wanted, start
            rest = [time for time, _ in topic.between(end=start)]
            assert rest + wanted == whole, start
        assert len(topic.between("1").between(end="2").to_arrow()) == 3
        nothing = topic.between("1", "1")
        assert nothing.to_arrow().num_rows == len(nothing.to_columns()) == 0
        assert nothing.to_arrow().schema == topic.to_arrow().schema
        for window in (("1h",), (10, 20), ("2", "1"), (None, timedelta(days=-1))):
            with pytest.raises(RecordingError, match="range of times"):
                topic.between(*window)


@pytest.mark.parametrize("text", ["", "soon", "1x", "2023-13-01", "1e5", "9" * 50, "٣", "-3"])
def test_what_is_no_time_is_refused(text, tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES)
    with idlc.Recording(path) as recording, pytest.raises(RecordingError, match="is not a time"):
        recording["/imu"].between(text)


@pytest.mark.parametrize("value", [1.5, True, None.__class__, np.float64(3)])
def test_what_is_no_time_at_all_is_a_mistake(value, tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES)
    with idlc.Recording(path) as recording, pytest.raises(TypeError):
        recording["/imu"].between(value)


def test_columns_are_chosen_and_times_converted(tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES)
    with idlc.Recording(path) as recording:
        topic = recording["/joints"]
        columns = topic.to_columns(fields=["header.stamp", "name"], datetimes=True)
        assert columns.keys() == ["log_time", "publish_time", "header", "name"]
        assert columns["log_time"].dtype == columns["header"]["stamp"].dtype == "M8[ns]"
        flat = topic.to_arrow(fields=["header.stamp"], flat=True)
        assert flat.column_names[2:] == ["header.stamp.sec", "header.stamp.nanosec"]


def generated(tmp_path, text):
    (tmp_path / "Thing.msg").write_text(text)
    return idlc.load(str(tmp_path / "Thing.msg")).Thing


def test_a_class_of_another_type_is_refused(tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES)
    imu = idlc.load("sensor_msgs/msg/Imu").Imu
    with idlc.Recording(path) as recording:
        topic = recording["/imu"]
        assert type(next(topic.messages(imu)).message) is imu
        assert topic.to_arrow(imu).equals(topic.to_arrow())
        with pytest.raises(RecordingError, match="messages of sensor_msgs/msg/Imu, not of"):
            topic.to_arrow(idlc.load("sensor_msgs/msg/Joy").Joy)
        with pytest.raises(RecordingError, match="not a message class of idlc"):
            next(topic.messages(int))


def test_a_class_whose_type_has_changed_since_is_refused(tmp_path):
    changed = "int32 a\nint32 b\n"
    kind = generated(tmp_path, "int32 a\n")
    package = kind.__module__.split(".")[-3]
    other = tmp_path / "other.mcap"
    with other.open("wb") as file:
        writer = made.Writer(file)
        writer.start()
        schema = writer.register_schema(f"{package}/msg/Thing", "ros2msg", changed.encode())
        channel = writer.register_channel("/thing", "cdr", schema)
        writer.add_message(channel, 1, kind(a=7).serialize() + bytes(4), 1)
        writer.finish()
    with idlc.Recording(other) as recording:
        with pytest.raises(RecordingError, match="was another type when `/thing` was recorded"):
            recording["/thing"].to_arrow(kind)
        assert recording["/thing"].to_arrow().to_pylist()[0]["b"] == 0


def test_names_that_a_field_has_are_not_taken_twice(tmp_path):
    kind = generated(tmp_path, "int64 log_time\nint64 publish_time\n")
    package = kind.__module__.split(".")[-3]
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = made.Writer(file)
        writer.start()
        text = b"int64 log_time\nint64 publish_time\n"
        schema = writer.register_schema(f"{package}/msg/Thing", "ros2msg", text)
        channel = writer.register_channel("/thing", "cdr", schema)
        writer.add_message(channel, 1, kind(log_time=7, publish_time=8).serialize(), 2)
        writer.finish()
    with idlc.Recording(path) as recording:
        topic = recording["/thing"]
        names = ["_log_time", "_publish_time", "log_time", "publish_time"]
        assert topic.to_arrow().column_names == names
        assert topic.to_columns().to_list() == [dict(zip(names, (1, 2, 7, 8), strict=True))]


def test_an_empty_definition_is_looked_up_here(tmp_path, monkeypatch):
    monkeypatch.setattr(made, "definition", "".format)
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES)
    monkeypatch.undo()
    wanted = made.by_mcap(tmp_path / "b.mcap", MESSAGES)
    with idlc.Recording(path) as recording, idlc.Recording(wanted) as other:
        assert recording["/imu"].topic.schema.is_blank
        assert recording["/imu"].to_arrow().equals(other["/imu"].to_arrow())


def test_what_cannot_be_known_is_refused(tmp_path):
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = made.Writer(file)
        writer.start()
        schemas = {
            "/unknown": writer.register_schema("nowhere_msgs/msg/Thing", "ros2msg", b""),
            "/json": writer.register_schema("Thing", "jsonschema", b"{}"),
            "/none": 0,
            "/broken": writer.register_schema("some_msgs/msg/Thing", "ros2msg", b"int33 a\n"),
        }
        for topic, schema in schemas.items():
            writer.add_message(writer.register_channel(topic, "cdr", schema), 1, b"{}", 1)
        writer.finish()
    with idlc.Recording(path) as recording:
        for topic in schemas:
            with pytest.raises(RecordingError, match=f"`{topic}`"):
                recording[topic].to_arrow()


@pytest.mark.parametrize("encoding", ["ros1", "json", ""])
def test_messages_that_are_written_in_another_way_are_refused(encoding, tmp_path):
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = made.Writer(file)
        writer.start()
        schema = writer.register_schema("std_msgs/String", "ros1msg", b"string data")
        writer.add_message(writer.register_channel("/x", encoding, schema), 1, bytes(8), 1)
        writer.finish()
    with idlc.Recording(path) as recording:
        for read in (recording["/x"].to_arrow, lambda: list(recording["/x"])):
            with pytest.raises(RecordingError, match=f"are written as `{encoding}`"):
                read()


def test_a_broken_message_is_named(tmp_path):
    found = [*MESSAGES[:40], MESSAGES[42]._replace(data=MESSAGES[42].data[:50]), *MESSAGES[43:]]
    path = made.by_mcap(tmp_path / "a.mcap", found)
    with idlc.Recording(path) as recording:
        topic = recording["/imu"]
        for read in (topic.to_arrow, topic.to_columns, lambda: list(topic)):
            with pytest.raises(RecordingError, match="message 14 of `/imu` is broken: "):
                read()


def test_messages_can_be_pickled_for_another_process(tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES)
    with idlc.Recording(path) as recording:
        message = next(iter(recording["/imu"])).message
    kept = tmp_path / "message.pickle"
    kept.write_bytes(pickle.dumps(message))
    code = f"import pickle; print(pickle.load(open({str(kept)!r}, 'rb')) is not None)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "True\n"


def test_messages_show_the_names_of_generated_ones(tmp_path):
    from IPython.lib.pretty import pretty

    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES)
    with idlc.Recording(path) as recording:
        message = next(iter(recording["/imu"])).message
        assert repr(recording).splitlines()[1:] == [
            "/imu           sensor_msgs/msg/Imu         20",
            "/joints        sensor_msgs/msg/JointState  20",
            "/camera/image  sensor_msgs/msg/Image       20",
        ]
        topic = recording["/imu"]
        rate = "20 messages in 5.9 s, 3.2 per second"
        assert repr(topic) == f"</imu in {path}: sensor_msgs/msg/Imu, {rate}>"
        for part in (topic.between("1", "2"), topic.where("linear_acceleration.z", ">", 0)):
            assert repr(part) == f"<part of /imu in {path}: sensor_msgs/msg/Imu>"
    assert repr(message).startswith("sensor_msgs.msg.Imu(header=std_msgs.msg.Header(stamp=builtin")
    assert "loaded" not in repr(message)
    assert "loaded" not in pretty(message)
    assert inspect.getsource(type(message)).startswith("@_idlc.define")
    assert pickle.loads(pickle.dumps(message)) == message


def test_packages_that_share_a_runtime_may_describe_a_type_differently(tmp_path):
    definitions = {"old": "float32 x\n", "new": "string<=2 name\nfloat32 x\n"}
    points = {}
    for age, definition in definitions.items():
        (tmp_path / age / "demo_msgs/msg").mkdir(parents=True)
        (tmp_path / age / "demo_msgs/msg/Point.msg").write_text(definition, encoding="utf-8")
        points[age] = idlc.load(str(tmp_path / age / "demo_msgs")).Point
    old, new = points["old"](1.5), points["new"]("ab", 1.5)
    assert type(old).__mro__[1] is type(new).__mro__[1]
    for message in (old, new, old):
        message.validate()
        assert type(message).from_dict(message.to_dict()) == message
    with pytest.raises(ValueError, match="characters, at most 2"):
        points["new"]("abc").validate()
    with pytest.raises(ValueError, match="4 bytes"):
        points["old"].deserialize(b"\0\1\0\0")
    with pytest.raises(ValueError, match="name: the number of bytes of text"):
        points["new"].deserialize(b"\0\1\0\0")
    assert repr(old) == "demo_msgs.msg.Point(x=1.5)"


def test_help_and_type_checkers_see_what_is_there(tmp_path):
    assert {"Recording", "load"} <= set(dir(idlc))
    assert "class Recording" in pydoc.plain(pydoc.render_doc(idlc))
    code = (
        "from idlc import Recording, load\n"
        "topic = Recording('a.mcap')['/x']\n"
        "for pair in topic.messages(bytes):\n"
        "    time, message = pair\n"
        "    reveal_type((topic, time, message, pair.message))\n"
        "reveal_type(load('a.mcap'))\n"
    )
    (tmp_path / "mypy.ini").write_text("[mypy-idlc.*]\nfollow_imports = silent\n", encoding="utf-8")
    # in a process of its own: mypy raises the recursion limit for good
    words = ["-m", "mypy", "--strict", "--config-file", tmp_path / "mypy.ini", "-c", code]
    said = programs.run(sys.executable, *words, cwd=ROOT)
    said = said.replace("builtins.", "")  # as older versions of mypy say
    assert "[idlc.api.recording.RecordedTopic, int, bytes, bytes]" in said
    assert '"idlc.recordings.load.LoadedPackages"' in said


def test_idlc_itself_stays_cheap_to_import():
    code = "import idlc, sys; print({'numpy', 'click', 'msgspec'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"
