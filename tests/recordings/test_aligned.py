"""Topics on one clock: equal to what pandas and numpy find, message by message."""

import json
import pickle
import random

import numpy as np
import pyarrow as pa
import pytest

import idlc
from idlc.recordings.aligned import clock
from idlc.recordings.containers.source import RecordingError
from tests.support import recordings as made
from tests.support.rounds import rounds

MS = 1_000_000
TOPICS = {"/imu": ["orientation", "angular_velocity"], "/joints": ["header.frame_id", "position"]}
NUMBERS = "/imu.angular_velocity.x"


def random_recording(path, seed):
    """Write a recording whose clocks jump, with messages of one time, perhaps without a topic."""
    rng, found = random.Random(seed), []
    time = made.START
    left_out = rng.choice([None, None, None, *made.MAKERS])
    for _ in range(rng.randrange(1, 80)):
        time += rng.choice([0, 0, 1, rng.randrange(200 * MS), -rng.randrange(300 * MS)])
        topic = rng.choice([*made.MAKERS])
        type_, make = made.MAKERS[topic]
        stamp = time + rng.choice([0, 5, -rng.randrange(100 * MS)])
        data = bytes(made.STORE.serialize_cdr(make(rng, stamp), type_))
        if topic != left_out:
            found.append(made.Recorded(topic, type_, time, time, data))
    names = {message.topic for message in found}
    lacking = [topic for topic in made.MAKERS if topic not in names]
    return made.by_mcap(path, found, chunk_size=rng.choice([100, 3000])), lacking


def times_of(recording, topic, clock):
    """Return the times of messages, and their order by these, as a person would compute them."""
    table = recording[topic].to_arrow(fields=["header.stamp"], flat=True, datetimes=True)
    times = table["log_time" if clock == "log" else "header.stamp"].cast(pa.int64()).to_numpy()
    return times, np.argsort(times, kind="stable")


def rows_of(times, ticks, how, tolerance):
    """Return the row of each tick by pandas, -1 if there is none."""
    import pandas as pd

    left = pd.DataFrame({"time": ticks})
    right = pd.DataFrame({"time": times, "row": np.arange(len(times))})
    direction = {"last": "backward", "nearest": "nearest"}[how]
    found = pd.merge_asof(left, right, on="time", direction=direction, tolerance=tolerance)
    return found["row"].fillna(-1).astype(int).to_numpy()


@pytest.mark.parametrize("clock", ["log", "header"])
@pytest.mark.parametrize("how", ["last", "nearest"])
def test_the_messages_of_ticks_are_those_that_pandas_finds(how, clock, tmp_path):
    for seed in range(rounds(24)):
        path, lacking = random_recording(tmp_path / f"{seed}.mcap", seed)
        rng = random.Random(seed)
        tolerance = rng.choice([None, 0, 50 * MS])
        with idlc.Recording(path) as recording:
            topics = {name: fields for name, fields in TOPICS.items() if name not in lacking}
            options = {"how": how, "tolerance": tolerance or None, "clock": clock}
            options |= rng.choice([{"on": name} for name in topics] + [{"every": "70ms"}] * 2)
            if not topics:
                continue
            tolerance = options["tolerance"]
            table = recording.aligned(topics, **options)
            arrow = table.to_arrow()
            ticks = arrow["time"].cast(pa.int64()).to_numpy()
            assert (np.diff(ticks) >= 0).all()
            for name in topics:
                times, order = times_of(recording, name, clock)
                values = recording[name].to_arrow(fields=topics[name], flat=True).take(order)
                rows = rows_of(times[order], ticks, how, tolerance)
                if options.get("on") == name:
                    assert ticks.tolist() == times[order].tolist()
                    rows = np.arange(len(ticks))
                index = pa.array(rows, mask=rows < 0)
                for column in values.column_names[2:]:
                    assert (
                        arrow[f"{name}.{column}"].to_pylist()
                        == values[column].take(index).to_pylist()
                    )
                age = np.where(rows < 0, 0, ticks - times[order][rows])
                ages = arrow[f"{name}.age"].cast(pa.int64())
                assert ages.is_null().to_numpy().tolist() == (rows < 0).tolist()
                assert ages.fill_null(0).to_numpy().tolist() == age.tolist()
            parts = pickle.loads(pickle.dumps(table.parts(rng.choice([1, 2000]))))
            assert pa.concat_tables([part.to_arrow() for part in parts] or [arrow]).equals(arrow)


def test_numbers_lie_on_the_lines_that_numpy_draws(tmp_path):
    for seed in range(rounds(24)):
        path, lacking = random_recording(tmp_path / f"{seed}.mcap", seed)
        if "/imu" in lacking:
            continue
        with idlc.Recording(path) as recording:
            topics = {"/imu": ["angular_velocity", "orientation", "angular_velocity_covariance"]}
            clock = ("log", "header")[seed % 2]
            table = recording.aligned(topics, every="7ms", how="linear", clock=clock).to_numpy()
            times, order = times_of(recording, "/imu", clock)
            columns = recording["/imu"].to_columns(fields=topics["/imu"])
            ticks = table["time"].view(np.int64)
            start = times.min()
            for axis in "xyz":
                wanted = np.interp(
                    ticks - start, times[order] - start, columns["angular_velocity"][axis][order]
                )
                found = table[f"/imu.angular_velocity.{axis}"]
                np.testing.assert_allclose(found.filled(np.nan), wanted)
            covariances = table["/imu.angular_velocity_covariance"]
            wanted = np.interp(
                ticks - start,
                times[order] - start,
                columns["angular_velocity_covariance"][order][:, 8],
            )
            np.testing.assert_allclose(covariances[:, 8].filled(np.nan), wanted)


def test_quaternions_turn_at_a_constant_rate():
    """Half a turn about z in steps, to either sign of a quaternion, and to a long one."""
    weights = np.linspace(0, 1, 7)
    angle = 3.0

    def about_z(turned):
        return np.array([0, 0, np.sin(turned / 2), np.cos(turned / 2)])

    for sign, size in ((1, 1), (-1, 1), (1, 5)):
        first = np.tile(about_z(0.0), (7, 1))
        second = np.tile(sign * size * about_z(angle), (7, 1))
        turned = clock.turned(first, second, weights)
        wanted = np.stack([about_z(weight * angle) for weight in weights])
        np.testing.assert_allclose(turned, wanted, atol=1e-12)
    near = clock.turned(first, np.tile(about_z(1e-9), (7, 1)), weights)
    np.testing.assert_allclose(near[:, 2], weights * 5e-10)
    assert np.isnan(clock.turned(np.zeros((1, 4)), np.ones((1, 4)), np.array([0.5]))).all()


#: What cannot be asked for -> the message.
REFUSED = {
    "both": ({"on": "/imu", "every": "1s"}, "either `on` a topic or `every`"),
    "neither": ({}, "either `on` a topic or `every`"),
    "unknown clock": ({"on": "/nothing"}, "has no topic `/nothing`"),
    "unknown in a mapping": ({"on": "/imu", "how": {"/im": "last"}}, "has no topic `/im`"),
    "no such way": ({"on": "/imu", "how": "cubic"}, "how='cubic' is not one of last"),
    "no such time": ({"on": "/imu", "clock": "publish"}, "clock='publish' is not one of log"),
    "a length without a unit": ({"every": "100"}, "'100' is not a length of time"),
    "no length": ({"every": "0ms"}, "'0ms' is not a length of time"),
    "less than a nanosecond": ({"every": "3GHz"}, "'3GHz' is not a length of time"),
    "texts between": (
        {"on": "/joints", "how": "linear", "topics": ["/camera/image"]},
        r"`/camera/image.header.stamp` \(timestamp.*`/camera/image.height` \(uint32.*encoding",
    ),
    "elements that change places": (
        {"every": "1s", "how": "linear", "topics": {"/joints": "position"}},
        r"`/joints.position` \(large_list<item: double>\)",
    ),
    "a part of a turn": (
        {"every": "1s", "how": "linear", "topics": {"/imu": "orientation.x"}},
        r"`/imu.orientation` \(a part of a quaternion\)",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_no_table_has_is_refused(case, tmp_path):
    options, message = REFUSED[case]
    path = made.by_mcap(tmp_path / "a.mcap", made.messages(9))
    with idlc.Recording(path) as recording, pytest.raises(RecordingError, match=message):
        recording.aligned(**{"topics": ["/imu"], **options})


def test_one_wrong_time_does_not_make_billions_of_rows(tmp_path):
    found = made.messages(30)
    found[3] = found[3]._replace(log_time=0)
    with idlc.Recording(made.by_mcap(tmp_path / "a.mcap", found)) as recording:
        table = recording.aligned(["/imu", "/joints"], every="10ms")
        with pytest.raises(RecordingError, match=r"170,000,000,\d+ rows for 20 messages"):
            table.to_arrow()
        rows = recording.aligned(["/imu"], every="10ms", start=made.START).to_arrow().num_rows
        assert rows == 271


@pytest.mark.parametrize("how", ["last", "nearest", "linear"])
def test_a_topic_without_messages_has_no_values(how, tmp_path):
    path = tmp_path / "a.mcap"
    found = made.messages(9)
    with path.open("wb") as file:
        writer = made.Writer(file)
        writer.start(profile="ros2")
        for topic in ("/imu", "/other"):
            text = made.definition(made.IMU).encode()
            schema = writer.register_schema(made.IMU, "ros2msg", text)
            channel = writer.register_channel(topic, "cdr", schema)
            for message in made.of_topic(found, topic):
                writer.add_message(channel, message.log_time, message.data, message.log_time)
        writer.finish()
    topics = {"/imu": "angular_velocity", "/other": "angular_velocity"}
    with idlc.Recording(path) as recording:
        for clock, count in (({"on": "/imu"}, 3), ({"every": "300ms"}, 3), ({"on": "/other"}, 0)):
            table = recording.aligned(topics, how={"/other": how}, **clock)
            arrow = table.to_arrow()
            assert [len(arrow), arrow["/other.age"].null_count] == [count, count]
            assert [arrow[NUMBERS].null_count, table.summary()[1].missing] == [0, count]
            assert sum(len(part.to_arrow()) for part in table.parts()) == count


def test_a_stamp_that_a_recording_defines_in_its_own_way_is_no_clock(tmp_path):
    parts = ["std_msgs/Header header", "=" * 80, "MSG: std_msgs/Header"]
    parts += ["builtin_interfaces/Time stamp", "=" * 80, "MSG: builtin_interfaces/Time"]
    text = "\n".join([*parts, "int32 sec", "uint32 ticks  # [us]"])
    with (tmp_path / "a.mcap").open("wb") as file:
        writer = made.Writer(file)
        writer.start(profile="ros2")
        schema = writer.register_schema("own_msgs/msg/Stamped", "ros2msg", text.encode())
        channel = writer.register_channel("/a", "cdr", schema)
        writer.add_message(channel, 1, b"\0\1\0\0" + bytes(8), 1)
        writer.finish()
    with idlc.Recording(tmp_path / "a.mcap") as recording:
        table = recording.aligned(["/a"], on="/a")
        assert table.to_arrow()["/a.header.stamp.ticks"].to_pylist() == [0]
        assert table.schema.field("/a.header.stamp.ticks").metadata == {b"ros2.unit": b"us"}
        with pytest.raises(RecordingError, match=r"messages of /a have no header.stamp"):
            recording.aligned(["/a"], on="/a", clock="header")


def test_a_header_of_its_own_is_no_clock(tmp_path):
    found = [message for message in made.varied() if message.topic in ("/Bool", "/TFMessage")]
    with idlc.Recording(made.by_mcap(tmp_path / "a.mcap", found)) as recording:
        with pytest.raises(
            RecordingError, match=r"messages of /TFMessage, /Bool have no header.stamp"
        ):
            recording.aligned(["/TFMessage", "/Bool"], on="/Bool", clock="header")
        assert recording.aligned(["/Bool"], on="/TFMessage").to_arrow().num_rows == 5


def test_columns_say_what_they_mean(tmp_path):
    battery = [message for message in made.varied() if message.topic == "/BatteryState"]
    with idlc.Recording(made.by_mcap(tmp_path / "a.mcap", battery)) as recording:
        schema = recording.aligned(["/BatteryState"], every="30Hz").schema
        health = json.loads(
            schema.field("/BatteryState.power_supply_health").metadata[b"ros2.enum"]
        )
        assert health["2"] == "OVERHEAT"
        about = json.loads(schema.metadata[b"idlc.aligned"])
        assert about["every"] == "100000000/3"
        assert about["topics"]["/BatteryState"]["how"] == "last"


def test_a_grid_of_hertz_does_not_drift(tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", made.messages(60))
    with idlc.Recording(path) as recording:
        times = recording.aligned(["/imu"], every="30Hz").to_numpy()["time"].view(np.int64)
        wanted = [made.START + index * made.SECOND // 30 for index in range(len(times))]
        assert times.tolist() == wanted
