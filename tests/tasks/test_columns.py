"""`idlc columns`: recordings become files that everybody's tools read, whole or not at all."""

import csv
import io
import json
import os
import subprocess
import sys
from base64 import b64decode

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

import idlc
from idlc.cli.main import main
from tests.support import recorded_text
from tests.support import recordings as made

MESSAGES = made.messages()


@pytest.fixture
def recording(here):
    return made.by_mcap(here / "rec.mcap", MESSAGES, chunk_size=3000)


def run(*words):
    return main([str(word) for word in ("columns", *words)])


def table(recording, topic, **options):
    with idlc.Recording(recording) as opened:
        return opened[topic].to_arrow(**{"flat": True, "datetimes": True, **options})


def test_a_newcomer_gets_from_a_file_to_a_data_frame(recording, here, capfd):
    import pandas as pd

    assert main(["show", str(recording)]) == 0
    shown = capfd.readouterr().out
    assert "/imu" in shown
    assert "sensor_msgs/msg/Imu" in shown
    assert run(recording, "/imu", "-o", "imu.parquet") == 0
    assert capfd.readouterr().err == "/imu: 20 messages → imu.parquet\n"
    frame = pd.read_parquet("imu.parquet")
    assert len(frame) == 20
    mine = [one for one in MESSAGES if one.topic == "/imu"]
    assert list(frame["log_time"].astype("int64")) == [one.log_time for one in mine]
    sent = [made.STORE.deserialize_cdr(one.data, one.type) for one in mine]
    assert list(frame["angular_velocity.z"]) == [one.angular_velocity.z for one in sent]
    delays = (frame["log_time"] - frame["header.stamp"]).dt.total_seconds() * 1e9
    assert [round(one) for one in delays] == [5] * 20


@pytest.mark.parametrize("name", ["a.parquet", "a.pq", "a.arrow", "a.feather"])
@pytest.mark.parametrize("topic", made.MAKERS)
def test_files_hold_the_tables(recording, name, topic):
    assert run(recording, topic, "-o", name) == 0
    if name.endswith(("parquet", "pq")):
        found = parquet.read_table(name)
    else:
        with pa.ipc.open_file(name) as file:
            found = file.read_all()
    wanted = table(recording, topic)
    assert found.to_pylist() == wanted.to_pylist()
    assert found.schema.names == wanted.schema.names
    assert found.schema.metadata[b"ros2.type"] == made.MAKERS[topic][0].encode()


def test_options_choose_rows_and_columns(recording):
    chosen = ("--fields", "header.stamp, position", "--from", "2", "--to", "3")
    assert run(recording, "/joints", *chosen, "-o", "a.parquet") == 0
    found = parquet.read_table("a.parquet")
    assert found.column_names == ["log_time", "publish_time", "header.stamp", "position"]
    assert len(found) == 3
    assert run(recording, "/imu", "--nested", "--no-datetimes", "-o", "b.parquet") == 0
    found = parquet.read_table("b.parquet")
    assert found.to_pylist() == table(recording, "/imu", flat=False, datetimes=False).to_pylist()


@pytest.mark.parametrize("words", [["drive_*.mcap"], ["drive_0.mcap", "drive_1.mcap"]])
def test_several_recordings_are_read_as_one(words, here):
    for number in range(2):
        made.by_mcap(here / f"drive_{number}.mcap", MESSAGES[number * 30 : number * 30 + 30])
    assert run(*words, "/imu", "-o", "a.parquet") == 0
    found = parquet.read_table("a.parquet")["log_time"].cast("int64").to_pylist()
    assert found == [one.log_time for one in MESSAGES if one.topic == "/imu"]


def test_a_name_may_stand_for_topics_of_several_types(here, capfd):
    text = "@ /x a_msgs/msg/A\nint8 a\n@ /x a_msgs/msg/B\nuint8 a\n@ /y a_msgs/msg/A\nint8 a\n"
    recorded_text.write("rec.mcap", text, {"/x": 1, "/y": 2})
    assert main(["show", "rec.mcap", "--format", "json"]) == 0
    _, *lines = [json.loads(line) for line in capfd.readouterr().out.splitlines()]
    assert [one["name"] for one in lines] == ["/x", "/x", "/y"]
    assert lines[0]["hash"] == lines[2]["hash"] != lines[1]["hash"]
    assert run("rec.mcap", "-o", "out/") == 1
    said = capfd.readouterr().err
    assert "`/x` has messages of several types, a_msgs/msg/A, a_msgs/msg/B" in said
    assert "/y: 2 messages → out/y.parquet" in said
    assert [path.name for path in (here / "out").iterdir()] == ["y.parquet"]
    assert run("rec.mcap", "/x", "/y", "-o", "other/") == 1
    assert not (here / "other").exists()


def test_a_folder_of_bags_is_none(here, capfd):
    made.by_rosbags(here / "bags/first", MESSAGES, "db3")
    assert run("bags", "/imu", "-o", "a.csv") == 1
    assert "pass a bag in it, such as `bags/first`" in capfd.readouterr().err
    assert run("nothing_*.mcap", "-o", "a.csv") == 2
    assert "no such file or folder: `nothing_*.mcap`" in capfd.readouterr().err


def test_a_pipe_gets_the_stream_format(recording):
    command = [sys.executable, "-m", "idlc", "columns", str(recording), "/imu"]
    done = subprocess.run(command, capture_output=True, check=True)
    with pa.ipc.open_stream(done.stdout) as stream:
        assert stream.read_all().equals(table(recording, "/imu"))


def test_a_csv_file_has_lists_as_json_and_bytes_in_base64(recording, capfdbinary):
    assert run(recording, "/joints", "-o", "joints.csv") == 0
    with open("joints.csv", newline="") as file:  # noqa: PTH123
        rows = list(csv.DictReader(file))
    wanted = table(recording, "/joints").to_pylist()
    assert [json.loads(row["name"]) for row in rows] == [row["name"] for row in wanted]
    assert [json.loads(row["effort"]) for row in rows] == [row["effort"] for row in wanted]
    assert run(recording, "/camera/image", "--format", "csv", "--fields", "data,encoding") == 0
    text = capfdbinary.readouterr().out.decode()
    rows = list(csv.DictReader(io.StringIO(text)))
    wanted = table(recording, "/camera/image").to_pylist()
    assert [b64decode(row["data"]) for row in rows] == [row["data"] for row in wanted]


def test_several_topics_go_to_a_folder_or_to_names_of_their_own(recording, here):
    assert run(recording, "-o", "all") == 0
    names = {"camera.image.parquet", "imu.parquet", "joints.parquet"}
    assert {path.name for path in (here / "all").iterdir()} == names
    assert run(recording, "/imu", "/joints", "-o", "x/{topic}.csv") == 0
    assert {path.name for path in (here / "x").iterdir()} == {"imu.csv", "joints.csv"}
    assert run(recording, "/imu", "-o", "all", "--format", "arrow") == 0
    assert (here / "all" / "imu.arrow").exists()


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        (["/im", "-o", "a.csv"], 2, "did you mean `/imu`?"),
        (["/imu", "-o", "a.txt"], 2, "has no extension of a known format"),
        (["/imu", "/joints", "-o", "a.csv"], 2, "/imu, /joints cannot all go to `a.csv`"),
        (["/imu", "/joints"], 2, "cannot all go to standard output"),
        (["/imu", "--from", "soon", "-o", "a.csv"], 1, "`soon` is not a time"),
        (["/imu", "--fields", "nothing", "-o", "a.csv"], 2, "Imu has no field 'nothing'"),
        (["/imu", "-o", "rec.mcap/a.csv"], 1, "cannot be written"),
    ],
)
def test_what_cannot_be_done_is_said_and_leaves_nothing(
    recording, here, words, status, said, capfd
):
    assert run(recording, *words) == status
    assert said in capfd.readouterr().err
    assert [path.name for path in here.iterdir()] == ["rec.mcap"]


def test_nothing_is_replaced_unless_it_is_asked_for(recording, here, capfd):
    (here / "a.csv").write_text("mine\n")
    assert run(recording, "/imu", "-o", "a.csv") == 1
    assert "`a.csv` exists" in capfd.readouterr().err
    assert (here / "a.csv").read_text() == "mine\n"
    assert run(recording, "/imu", "-o", "a.csv", "--force") == 0
    assert (here / "a.csv").read_text() != "mine\n"


def test_a_run_that_fails_in_the_middle_leaves_what_was_there(here, capfd):
    broken = [*MESSAGES[:-3], *(one._replace(data=one.data[:40]) for one in MESSAGES[-3:])]
    recording = made.by_mcap(here / "rec.mcap", broken)
    (here / "imu.parquet").write_text("mine\n")
    assert run(recording, "/imu", "-o", "imu.parquet", "--force") == 1
    assert "message 19 of `/imu` is broken" in capfd.readouterr().err
    assert (here / "imu.parquet").read_text() == "mine\n"
    assert sorted(path.name for path in here.iterdir()) == ["imu.parquet", "rec.mcap"]


def test_names_of_topics_do_not_leave_the_folder(here):
    found = [one._replace(topic="/../../etc/\x1b[31m") for one in MESSAGES if one.topic == "/imu"]
    recording = made.by_mcap(here / "rec.mcap", found)
    assert run(recording, "-o", "out/") == 0
    assert [path.name for path in (here / "out").iterdir()] == ["etc.__31m.parquet"]


def test_what_is_unusual_is_noted(here, capfd):
    recording = made.by_mcap(here / "rec.mcap", MESSAGES, chunk_size=3000)
    recording.write_bytes(recording.read_bytes()[:9000])
    assert run(recording, "/imu", "-o", "imu.csv") == 1
    assert "read to its last whole record" in capfd.readouterr().err
    assert (here / "imu.csv").exists()


def test_without_arrow_it_is_said_how_to_install_it(recording, here):
    (here / "pyarrow.py").write_text("raise ImportError\n")
    command = [sys.executable, "-m", "idlc", "columns", str(recording), "/imu", "-o", "a.parquet"]
    env = {**os.environ, "PYTHONPATH": str(here)}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=env)
    assert done.returncode == 1
    assert "pip install 'idlc[recordings]'" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_terminal_sees_a_bar(recording):
    from idlc.cli import output

    class Terminal(io.StringIO):
        def isatty(self):
            return True

    seen = Terminal()
    with output.progress_bar(seen) as tell:
        tell("/imu", 5, 20)
        tell("/imu\x1b", 20, 20)
    assert "5 of 20  /imu" in seen.getvalue()
    assert "\x1b" not in seen.getvalue()
    assert seen.getvalue().rpartition("\r")[0].endswith(" ")


@pytest.mark.parametrize("compression", ["", "zstd"])
def test_memory_is_bounded_by_chunks_and_not_by_the_recording(compression, here):
    """A recording many times as large as a group of chunks takes not much more than one."""
    frames = (
        made.Recorded("/b", "std_msgs/msg/UInt8MultiArray", n, n, bytes(4 + 8) + data)
        for n in range(200)
        for data in [(1 << 20).to_bytes(4, "little") + bytes(1 << 20)]
    )
    recording = made.by_mcap(here / "rec.mcap", frames, compression)
    code = (
        "import resource\nfrom idlc.cli.main import main\n"
        "import pyarrow.parquet, numpy, zstandard\n"
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        f"assert main(['columns', {str(recording)!r}, '-o', 'out/']) == 0\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert parquet.read_metadata(here / "out" / "b.parquet").num_rows == 200
    assert int(done.stdout) < 190_000  # KiB: the messages are 205,000 and more


def test_a_shell_completes_topics(recording):
    words = {"COMP_WORDS": "idlc columns rec.mcap /", "COMP_CWORD": "3"}
    env = {**os.environ, **words, "_IDLC_COMPLETE": "bash_complete"}
    command = [sys.executable, "-m", "idlc"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=env)
    assert {line.partition(",")[2] for line in done.stdout.split()} >= {*made.MAKERS}


def test_a_topic_that_cannot_be_read_does_not_keep_others_from_being_written(here, capfd):
    broken = [one._replace(data=one.data[:9]) if one.topic == "/imu" else one for one in MESSAGES]
    recording = made.by_mcap(here / "rec.mcap", broken)
    assert run(recording, "-o", "out") == 1
    assert "message 0 of `/imu` is broken" in capfd.readouterr().err
    assert {path.name for path in (here / "out").iterdir()} == {
        "camera.image.parquet",
        "joints.parquet",
    }


# previews


def floats(topic, numbers, type_="std_msgs/msg/Float64", step=made.SECOND // 10):
    return [
        made.Recorded(topic, type_, time, time, bytes(made.STORE.serialize_cdr(message, type_)))
        for index, number in enumerate(numbers)
        for time in [made.START + index * step]
        for message in [made.kind(type_)(number)]
    ]


def shown(capfd, *words):
    assert run(*words, "--format", "text") == 0
    captured = capfd.readouterr()
    assert captured.err == ""
    return captured.out


def test_a_preview_has_first_rows_and_a_chart_of_each_number(recording, capfd, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    text = shown(capfd, recording, "/imu")
    lines = text.splitlines()
    assert lines[0] == "/imu  sensor_msgs/msg/Imu  20 messages in 5.7 s"
    assert max(map(len, lines)) <= 80
    frame = table(recording, "/imu").to_pandas()
    rows = {line.split()[0]: line for line in lines if line}
    turned = frame["angular_velocity.z"]
    *stats, chart = rows["angular_velocity.z"].split()[1:]
    assert stats == [f"{value:.5g}" for value in (turned.min(), turned.mean(), turned.max())]
    assert len(chart) == 10
    assert set(chart) <= set("▁▂▃▄▅▆▇█")
    first = next(line for line in lines if line.startswith("angular_velocity.z"))
    assert first.split()[1] == f"{turned[0]},"
    assert "orientation_covariance" not in text.partition("numbers over time")[2]


def test_a_single_column_of_numbers_has_a_larger_chart(here, capfd, monkeypatch):
    monkeypatch.setenv("COLUMNS", "60")
    rising = made.by_mcap(here / "rec.mcap", floats("/x", [number / 7 for number in range(1000)]))
    text = shown(capfd, rising, "/x")
    bars = text.splitlines()[-9:-1]
    heights = [sum(line[at : at + 1] in {*"▁▂▃▄▅▆▇█"} for line in bars) for at in range(60)]
    assert heights == sorted(heights)
    assert (heights[0], heights[-1]) == (1, 8)
    assert text.splitlines()[-1].split() == ["0", "99.9", "s"]
    assert "0, 0.14285714285714285, 0.285714" in text


@pytest.mark.parametrize("size", [1, 7, 400])
def test_a_chart_of_recordings_that_come_in_another_order(size, here, capfd, monkeypatch):
    monkeypatch.setenv("COLUMNS", "60")
    rising = floats("/x", range(1200))
    parts = [rising[at : at + size] for at in range(0, len(rising), size)]
    backwards = [message for part in reversed(parts) for message in part]
    for name, messages in {"sorted": rising, "other": backwards}.items():
        made.by_mcap(here / f"{name}.mcap", messages, chunk_size=1000)
    text = shown(capfd, "other.mcap", "/x")
    assert text.startswith("/x  std_msgs/msg/Float64  1,200 messages in 119.9 s\n")
    heights = [
        sum(line[at : at + 1] in {*"▁▂▃▄▅▆▇█"} for line in text.splitlines()[-9:-1])
        for at in range(60)
    ]
    assert heights == sorted(heights)
    assert (heights[0], heights[-1]) == (1, 8)


def test_a_preview_fits_a_narrow_terminal(recording, capfd, monkeypatch):
    monkeypatch.setenv("COLUMNS", "20")
    first, _, rest = shown(capfd, recording, "/imu").partition("\n")
    rows = rest.partition("numbers")[0].splitlines()[2:]
    assert max(map(len, rows)) == 20
    assert first.startswith("/imu  sensor_msgs/msg/Imu  20 messages")


INF, NAN = float("inf"), float("nan")


@pytest.mark.parametrize(
    ("numbers", "expected"),
    [
        ([NAN, INF, -INF, 5.0], "5          5          5  3 not finite"),
        ([1e308, -1e308, 1.7e308, -1.7e308], "-1.7e+308"),
        ([5e-324, 0.0], "4.9407e-324"),
        ([-1.2345e-300, -2.3456e-300], "-2.3456e-300 -1.79e-300 -1.2345e-300"),
        ([3.0], "3          3          3"),
        ([3.0] * 50, "\n\nconstant: data=3\n"),
        ([0.1, 0.1], "\n\nconstant: data=0.1\n"),
        ([0.1, NAN, 0.1], "0.1        0.1        0.1  1 not finite"),
        ([float(1 << 53)] * 2, "9.0072e+15"),  # which may be two integers
    ],
)
def test_a_chart_of_odd_numbers(numbers, expected, here, capfd):
    text = shown(capfd, made.by_mcap(here / "rec.mcap", floats("/x", numbers)), "/x")
    assert expected in text
    assert ("▁" in text) == ("constant" not in expected)


def test_numbers_that_are_never_finite_and_topics_without_messages(here, capfd):
    made.by_mcap(here / "nan.mcap", floats("/x", [NAN, INF]))
    assert "numbers over time" not in shown(capfd, "nan.mcap", "/x")
    recorded_text.write("none.mcap", "@ /x a_msgs/msg/A\nint8 a\n")
    text = shown(capfd, "none.mcap", "/x")
    assert text.startswith("/x  a_msgs/msg/A  0 messages\n")


def test_a_preview_of_integers_bools_and_times_that_go_astray(here, capfd):
    messages = [
        *floats("/int", [2**63 - 1, -(2**63)], "std_msgs/msg/Int64"),
        *floats("/bool", [True, False, True, True], "std_msgs/msg/Bool"),
    ]
    times = [0, 2**63 - 1, 5, made.START]
    messages[2:] = [
        each._replace(log_time=time) for each, time in zip(messages[2:], times, strict=True)
    ]
    made.by_mcap(here / "rec.mcap", messages)
    assert "9223372036854775807, -9223372036854775808" in shown(capfd, "rec.mcap", "/int")
    text = shown(capfd, "rec.mcap", "/bool")
    assert "4 messages in 9.22337e+09 s" in text
    assert "0.75" in text


def test_a_preview_shows_no_control_characters(here, capfd):
    text = "\x1b[31m\r\n\u202e日本" * 30
    name = "/\x1b]0;title\x07"
    made.by_mcap(here / "rec.mcap", floats(name, [text], "std_msgs/msg/String"))
    output = shown(capfd, "rec.mcap")
    assert not {*output} & {*"\x1b\r\x07\u202e"}
    assert output.startswith("/␛]0;title␇  std_msgs/msg/String  1 message\n")


def test_a_preview_goes_to_a_terminal_and_not_to_a_file(recording, capfd):
    pty = pytest.importorskip("pty")
    leader, follower = pty.openpty()
    command = [sys.executable, "-m", "idlc", "columns", str(recording), "/imu", "/joints"]
    done = subprocess.run(command, stdout=follower, stderr=subprocess.PIPE, check=True)
    os.close(follower)
    received = os.read(leader, 1 << 16).decode()
    os.close(leader)
    assert received.startswith("/imu  sensor_msgs/msg/Imu  20 messages in 5.7 s\r\n")
    assert "/joints  sensor_msgs/msg/JointState" in received
    assert not done.stderr
    assert run(recording, "/imu", "--format", "text", "-o", "a.txt") == 2
    assert "`--format text` writes no file" in capfd.readouterr().err


def test_a_preview_shows_bytes_and_durations_with_their_units(here, capfd):
    letters = np.arange(97, 113, dtype=np.uint8)
    identifiers = floats("/id", [letters], "unique_identifier_msgs/msg/UUID")
    type_, none = "trajectory_msgs/msg/JointTrajectoryPoint", np.zeros(0)
    wait = made.kind("builtin_interfaces/msg/Duration")(sec=1, nanosec=500_000_000)
    point = made.kind(type_)(none, none, none, none, time_from_start=wait)
    data = bytes(made.STORE.serialize_cdr(point, type_))
    points = [made.Recorded("/point", type_, made.START, made.START, data)]
    made.by_mcap(here / "rec.mcap", [*identifiers, *points])
    assert "0x6162636465666768696a6b6c6d6e6f70" in shown(capfd, "rec.mcap", "/id")
    assert "1.5 s" in shown(capfd, "rec.mcap", "/point")
