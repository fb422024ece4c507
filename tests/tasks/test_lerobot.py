"""`idlc columns --format lerobot`, compared with what LeRobot wrote, and with the aligned table."""

import io
import json
import random
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pyarrow import parquet

import idlc
from idlc.cli.main import main
from idlc.recordings.lerobot import statistics
from tests.support import lerobot_frames as known
from tests.support import mcap_mutations
from tests.support import recordings as made
from tests.support.rounds import rounds
from tests.support.waiting import PROGRAM, wait_for

TICK = made.SECOND // known.FPS
STATE, IMAGE = ("sensor_msgs/msg/JointState", "sensor_msgs/msg/Image")
ACTION = ("--feature", "action=/cmd")


def header():
    return made.header(random.Random(1), made.START)


def picture(pixels, encoding="rgb8"):
    height, width, channels = pixels.shape
    values = (height, width, encoding, 0, width * channels, pixels.reshape(-1))
    return made.kind(IMAGE)(header(), *values)


def joints(state, names=("shoulder", "elbow")):
    none = np.zeros(0)
    return made.kind(STATE)(header(), list(names), np.array(state), none, none)


def twist(forward, turn=0.0):
    vector = made.kind("geometry_msgs/msg/Vector3")
    twist = made.kind("geometry_msgs/msg/Twist")
    return twist(vector(forward, 0.0, 0.0), vector(0.0, 0.0, turn))


def data(type_, value):
    return made.kind(f"std_msgs/msg/{type_}")(value)


def recorded(tick, topic, message):
    type_, stamp = type(message).__msgtype__, made.START + int(tick * TICK)
    return made.Recorded(
        topic, type_, stamp, stamp, bytes(made.STORE.serialize_cdr(message, type_))
    )


def frames_of_episodes(by_topic=True):
    """Return the messages of known frames."""
    found = []
    for tick, frame in enumerate(known.frames()):
        if frame.is_first and by_topic:
            found.append(recorded(tick, "/task", data("String", frame.task)))
        found += [
            recorded(tick, "/joints", joints(frame.state)),
            recorded(tick, "/count", data("Int32", frame.count)),
            recorded(tick, "/flag", data("Bool", frame.flag)),
            recorded(tick, "/cmd", twist(*frame.action)),
            recorded(tick, "/top/image", picture(frame.picture)),
        ]
    return found


def simple(count=6, **changes):
    """Return messages of joints, a command and a camera, with what some topics have instead."""
    found = []
    for tick in range(count):
        pixels = np.full((64, 64, 3), [200, 100, 10 * tick], np.uint8)
        for topic, message in {
            "/joints": joints([tick / 2, 1.0]),
            "/cmd": twist(tick / 4),
            "/camera": picture(pixels),
        }.items():
            change = changes.get(topic[1:], {})
            instead = change.get(tick, message) if isinstance(change, dict) else change(tick)
            found += [] if instead is None else [recorded(tick, topic, instead)]
    return found


def wrote(*words, grid="10Hz", out="ds"):
    return main(["columns", *words, "--grid", grid, "--format", "lerobot", "-o", out]) == 0


def pictures_of(path):
    import av

    with av.open(str(path)) as file:
        return np.stack([frame.to_ndarray(format="rgb24") for frame in file.decode(video=0)])


def test_a_data_set_is_what_lerobot_writes_of_the_same_frames(here):
    golden = json.loads(known.GOLDEN.read_text(encoding="utf-8"))
    made.by_mcap(here / "rec.mcap", frames_of_episodes())
    columns = {
        "observation.state": "/joints.position",
        "observation.count": "/count",
        "observation.flag": "/flag",
        "action": "/cmd.linear.x,/cmd.angular.z",
        known.CAMERA: "/top/image",
    }
    options = [f"--feature={name}={paths}" for name, paths in columns.items()]
    assert wrote("rec.mcap", "--episodes", "/task", *options)
    found = json.loads(json.dumps(known.description(here / "ds")))
    same = ("info", "schemas", "rows", "tasks", "index", "files")
    assert {name: found[name] for name in same} == {name: golden[name] for name in same}
    pairs = [*zip(found["episodes"], golden["episodes"], strict=True)]
    pairs += [(found["stats"][name], each) for name, each in golden["stats"].items()]
    assert len(found["stats"]) == len(golden["stats"])
    for ours, theirs in pairs:
        assert ours.keys() == theirs.keys()
        for name, value in theirs.items():
            if name == "tasks":
                assert ours[name] == value
                continue
            # LeRobot computes with 32 bits, and its quantiles are as exact as a bin
            most, least = (name.rpartition("/")[0] + end for end in ("/max", "/min"))
            if "/" not in name:
                most, least = ("max", "min") if "max" in theirs else (name, name)
            spread = np.abs(np.subtract(theirs[most], theirs[least])).max()
            values = np.array(ours[name], float), np.array(value, float)
            np.testing.assert_allclose(*values, rtol=1e-5, atol=1e-5 + spread / 2000)


def test_frames_have_the_values_of_the_aligned_table(here, capfd):
    """Also units, arrays, several episodes of one bag each, and a start that has no value."""
    imu = made.kind("sensor_msgs/msg/Imu")
    zero = made.kind("geometry_msgs/msg/Vector3")(1.0, 2.0, 3.0)
    turn = made.kind("geometry_msgs/msg/Quaternion")(0.0, 0.0, 0.0, 1.0)
    for number, late in enumerate((0, 2)):
        found = simple(8, cmd=lambda tick, late=late: twist(tick / 8) if tick >= late else None)
        nine = np.arange(9.0) + number
        found += [recorded(0, "/imu", imu(header(), turn, nine, zero, nine, zero, nine))]
        made.by_rosbags(here / f"bag_{number}", found, "db3")
    topics = ("/joints:position", "/cmd:linear.x", "/imu:linear_acceleration_covariance", "/camera")
    assert wrote("bag_0", "bag_1", *topics, *ACTION, "--task", "wave", grid="100ms")
    printed = capfd.readouterr().err
    assert "2 episodes: 14 rows → ds" in printed
    assert "`bag_1`: left out 2 of 8 rows: before or after values of a topic" in printed
    info = json.loads(Path("ds/meta/info.json").read_text(encoding="utf-8"))
    features = info["features"]
    assert [*features][:4] == [
        "action",
        "observation.joints",
        "observation.imu",
        "observation.images.camera",
    ]
    assert features["action"]["names"] == ["linear.x"]
    assert features["observation.joints"]["names"] == ["position.shoulder", "position.elbow"]
    assert features["observation.imu"]["names"][8] == "linear_acceleration_covariance[8]"
    for number, late in enumerate((0, 2)):
        table = parquet.read_table(f"ds/data/chunk-000/file-00{number}.parquet")
        with idlc.Recording(f"bag_{number}") as recording:
            wanted = dict.fromkeys(("/joints", "/cmd", "/imu", "/camera"))
            aligned = recording.aligned(wanted, every="100ms").to_arrow().slice(late)
        assert table["action"].to_pylist() == aligned["/cmd.linear.x"].to_pylist()
        positions = aligned["/joints.position"].to_pylist()
        assert table["observation.joints"].to_pylist() == positions
        nine = aligned["/imu.linear_acceleration_covariance"].to_pylist()
        assert table["observation.imu"].to_pylist() == nine
        video = Path(f"ds/videos/observation.images.camera/chunk-000/file-00{number}.mp4")
        pixels = [idlc.to_numpy(row, "Image", prefix="/camera.") for row in aligned.to_pylist()]
        difference = np.abs(pictures_of(video).astype(int) - np.stack(pixels))
        assert difference.max() < 12
    frame = parquet.read_table("ds/meta/tasks.parquet").to_pandas()
    assert frame.iloc[0].name == "wave"


@pytest.mark.parametrize("encoding", ["rgb8", "bgr8", "rgba8", "bgra8", "mono8", "png", "jpeg"])
def test_a_video_has_the_colours_of_each_encoding(encoding, here):
    colour = {"mono8": [90] * 3}.get(encoding, [220, 120, 40])
    pixels = np.full((64, 80, 3), colour, np.uint8)
    if encoding in ("png", "jpeg"):
        file = io.BytesIO()
        Image.fromarray(pixels).save(file, encoding)
        bytes_ = np.frombuffer(file.getvalue(), np.uint8)
        message = made.kind("sensor_msgs/msg/CompressedImage")(header(), encoding, bytes_)
    else:
        if encoding.startswith("bgr"):
            pixels = pixels[:, :, ::-1]
        if "a" in encoding:
            pixels = np.dstack([pixels, np.full((64, 80), 7, np.uint8)])
        pixels = pixels[:, :, :1] if encoding == "mono8" else pixels
        message = picture(np.ascontiguousarray(pixels), encoding)
    made.by_mcap(here / "rec.mcap", [recorded(tick, "/camera", message) for tick in range(3)])
    assert wrote("rec.mcap")
    video = "ds/videos/observation.images.camera/chunk-000/file-000.mp4"
    assert np.abs(pictures_of(video).astype(int) - colour).max() < 8
    stats = json.loads(Path("ds/meta/stats.json").read_text(encoding="utf-8"))
    mean = np.array(stats["observation.images.camera"]["mean"]).reshape(3)
    assert np.abs(mean * 255 - colour).max() < 2


def test_messages_of_a_topic_begin_and_end_episodes(here, capfd):
    found = simple(12)
    found += [
        recorded(tick, "/run", data("Bool", value))
        for tick, value in ((2, True), (5, False), (8, True))
    ]
    made.by_mcap(here / "rec.mcap", found)
    assert wrote("rec.mcap", "/cmd:linear.x", "--episodes", "/run", "--task", "go")
    assert "outside of episodes" in capfd.readouterr().err
    table = parquet.read_table("ds/data")
    assert table["observation.cmd"].to_pylist() == [0.5, 0.75, 1.0, 2.0, 2.25, 2.5, 2.75]
    assert table["frame_index"].to_pylist() == [0, 1, 2, 0, 1, 2, 3]
    assert table["episode_index"].to_pylist() == [0] * 3 + [1] * 4


WRONG = {
    "a clock that is a topic": ({}, ["--grid", "/cmd"], "--format lerobot needs a period"),
    "part of a frame": ({}, ["--grid", "30ms"], "a whole number of frames per second, not 100/3"),
    "another output": ({}, ["--force"], "--format lerobot needs a new folder"),
    "no such column": ({}, ["--feature", "action=/cm"], "did you mean `/cmd`?"),
    "no such field": ({}, ["/cmd:linear.q"], "has no field 'linear.q'"),
    "no name": ({}, ["--feature", "/cmd"], "write `action=/cmd_vel`"),
    "a name of LeRobot": ({}, ["--feature", "index=/cmd"], "cannot have the name `index`"),
    "a name that is a path": ({}, ["--feature", "..=/cmd"], "cannot have the name `..`"),
    "a name of pictures": ({}, ["--feature", "image=/cmd"], "`image` has no pictures"),
    "pictures of two": ({}, ["--feature", "a=/cmd,/camera"], "the pictures of one topic"),
    "a gap": (
        {"cmd": {3: None}},
        ["--tolerance", "50ms"],
        "`/cmd` has no value in 1 of 6 rows, and LeRobot has no gaps",
    ),
    "a gap of an element": (
        {"joints": {3: joints([1.0], ["elbow"])}},
        [],
        "`/joints.position.shoulder` has no value, at 2023-11-14 22:13:20.300000000",
    ),
    "not a number": (
        {"cmd": {3: twist(float("nan"))}},
        [],
        "`/cmd.linear.x` has nan, which float32 cannot hold",
    ),
    "too large": ({"cmd": {3: twist(1e39)}}, [], "has 1e+39, which float32 cannot hold"),
    "another size": (
        {"camera": {3: picture(np.zeros((64, 32, 3), np.uint8))}},
        [],
        "a video has pictures of one size, not 64 × 64 and 32 × 64",
    ),
    "depths": (
        {"camera": {3: picture(np.zeros((64, 128, 1), np.uint8), "16UC1")}},
        [],
        "a picture of `/camera` has no video",
    ),
    "cut pixels": (
        {"camera": {3: made.kind(IMAGE)(header(), 64, 64, "rgb8", 0, 192, np.zeros(9, np.uint8))}},
        [],
        "the data has 9 bytes",
    ),
    "no pixels": (
        {"camera": lambda _: picture(np.zeros((0, 64, 3), np.uint8))},
        [],
        "a picture without pixels cannot be encoded",
    ),
    "too wide a picture": (
        {"camera": lambda _: picture(np.zeros((1, 70_000, 3), np.uint8))},
        [],
        "pictures of 70000 × 1 cannot be encoded",
    ),
    "no row": ({"cmd": lambda _: None}, ["--from", "0.51"], "in no row, each topic has a value"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_a_data_set_cannot_hold_is_refused(case, here, capfd):
    changes, words, message = WRONG[case]
    made.by_mcap(here / "rec.mcap", simple(**changes))
    assert not wrote("rec.mcap", *words, grid=words[1] if words[0:1] == ["--grid"] else "10Hz")
    assert message in capfd.readouterr().err
    assert sorted(path.name for path in here.iterdir()) == ["rec.mcap"]


def test_a_folder_that_exists_stays_as_it_is(here, capfd):
    made.by_mcap(here / "rec.mcap", simple())
    Path("ds").mkdir()
    assert not wrote("rec.mcap")
    assert "`ds` exists\n" in capfd.readouterr().err
    assert not [*Path("ds").iterdir()]


def test_recordings_with_other_columns_are_no_data_set(here, capfd):
    names = ["elbow", "shoulder"]
    made.by_mcap(here / "a.mcap", simple())
    made.by_mcap(here / "b.mcap", simple(joints=lambda tick: joints([1.0, tick], names)))
    assert not wrote("a.mcap", "b.mcap")
    assert "`observation.joints` is not as in the episodes before" in capfd.readouterr().err
    assert wrote("a.mcap", "b.mcap", "/joints:position.elbow,position.shoulder")
    rows = parquet.read_table("ds/data")["observation.joints"].to_pylist()
    assert rows[4] == [1.0, 2.0]
    assert rows[10] == [1.0, 4.0]


def test_numbers_keep_their_type_and_lists_their_length(here, capfd):
    layout = made.kind("std_msgs/msg/MultiArrayLayout")([], 0)

    def measures(*values):
        return made.kind("std_msgs/msg/Float32MultiArray")(layout, np.array(values, np.float32))

    found = [recorded(tick, "/large", data("Int64", 2**53 + tick)) for tick in range(3)]
    found += [recorded(tick, "/list", measures(tick, 0.5)) for tick in range(3)]
    made.by_mcap(here / "rec.mcap", found)
    assert wrote("rec.mcap", "/large", "/list:data")
    table = parquet.read_table("ds/data")
    assert table["observation.large"].to_pylist() == [2**53, 2**53 + 1, 2**53 + 2]
    assert table["observation.list"].to_pylist() == [[0, 0.5], [1, 0.5], [2, 0.5]]
    assert not wrote("rec.mcap", "/large", "/list:data", "--feature", "a=/list,/large", out="b")
    assert f"`/large.data` has {2**53 + 1}, which float32 cannot hold" in capfd.readouterr().err
    made.by_mcap(here / "rec.mcap", [*found, recorded(3, "/list", measures(1, 2, 3))])
    assert not wrote("rec.mcap", "/list:data", out="b")
    assert "has not always 2 elements" in capfd.readouterr().err


def test_only_pictures_need_pyav(here, capfd, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    made.by_mcap(here / "rec.mcap", simple())
    assert not wrote("rec.mcap")
    message = capfd.readouterr().err
    assert "PyAV encodes the videos, and av is not installed" in message
    assert "pip install 'idlc[lerobot]'" in message
    assert [path.name for path in here.iterdir()] == ["rec.mcap"]
    assert wrote("rec.mcap", "/joints", "/cmd")
    info = json.loads(Path("ds/meta/info.json").read_text(encoding="utf-8"))
    assert info["video_path"] is None


def test_a_process_that_is_killed_leaves_no_data_set(here):
    pixels = np.random.default_rng(1).integers(0, 255, (480, 640, 3), np.uint8)
    found = [recorded(tick, "/camera", picture(pixels)) for tick in range(4)]
    found += [recorded(10_000, "/camera", picture(pixels))]
    made.by_mcap(here / "rec.mcap", found)
    words = ["columns", "rec.mcap", "--grid", "10Hz", "--format", "lerobot", "-o", "ds"]
    with subprocess.Popen([sys.executable, "-m", "idlc", *words]) as process:
        wait_for(lambda: [*here.glob(".ds.*/videos/*/*/*")], "a video", limit=PROGRAM)
        process.kill()
    assert not Path("ds").exists()


def test_of_a_damaged_recording_is_written_what_can_be_read(here, capfd):
    made.by_mcap(here / "rec.mcap", simple(40), compression="", chunk_size=10_000)
    whole = Path("rec.mcap").read_bytes()
    Path("rec.mcap").write_bytes(whole[: len(whole) // 2])
    assert not wrote("rec.mcap", "--strict")
    assert not Path("ds").exists()
    assert not wrote("rec.mcap")
    assert "IDL656" in capfd.readouterr().err
    rows = parquet.read_table("ds/data")["observation.cmd"].to_pylist()
    assert 10 < len(rows) < 30
    assert [row[0] for row in rows] == [tick / 4 for tick in range(len(rows))]


def test_hostile_recordings_end_in_a_data_set_or_an_error(here, capfd):
    made.by_mcap(here / "rec.mcap", simple(4), chunk_size=3000)
    whole = Path("rec.mcap").read_bytes()
    rng, words = random.Random(7), ["columns", "rec.mcap", "--grid", "10Hz"]
    words += ["--format", "lerobot", "-o"]
    for number in range(rounds(40)):
        Path("rec.mcap").write_bytes(mcap_mutations.mutated(whole, rng))
        main([*words, f"ds{number}"])
        assert "IDL901" not in capfd.readouterr().err
    assert not [*here.glob(".ds*")]


def test_statistics_are_those_of_all_values():
    rng = np.random.default_rng(3)
    for _ in range(rounds(80)):
        values = rng.normal(rng.normal() * 10 ** rng.integers(6), 1, rng.integers(1, 300))
        values = np.round(values, int(rng.integers(4)))
        different, counts = np.unique(values, return_counts=True)
        found = statistics(different, counts)
        assert found == pytest.approx(statistics(values, np.ones(len(values), int)))
        expected = [values.min(), values.max(), values.mean(), values.std()]
        assert [*found.values()][:4] == pytest.approx(expected)
        if len(values) == 1:
            assert found["q01"] == found["q99"] == values[0]
            continue
        for quantile in (1, 10, 50, 90, 99):
            # the value of that rank, or of the bin around it
            rank = np.sort(values)[max(0, int(np.ceil(quantile / 100 * len(values))) - 1)]
            error = np.ptp(values) / 5000 + 1e-9 + 1e-12 * abs(rank)
            assert found[f"q{quantile:02}"] == pytest.approx(rank, abs=error, rel=0)
