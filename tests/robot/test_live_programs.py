"""The commands on robots as programs: signals, recordings for other readers, and completion."""

import json
import os
import shlex
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
from mcap_ros2.reader import read_ros2_messages

from idlc.cli.main import main
from idlc.robot.qos import DurabilityPolicy, QoSProfile
from tests.robot.fake import Robot, demo_classes, standard
from tests.support.waiting import LIMIT as LONG
from tests.support.waiting import read_line, wait_for

LATCHED = QoSProfile(depth=20, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SIGNALS = [signal.SIGINT, signal.SIGTERM]


@pytest.fixture(autouse=True)
def _in_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def robot(address):
    robot = Robot(address)
    robot.describe_types()
    yield robot
    robot.close()


@contextmanager
def started(*words):
    """Yield a running `idlc`, which is killed at the end."""
    command = [sys.executable, "-m", "idlc", *words]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, text=True, **pipes) as process:
        try:
            yield process
        finally:
            process.kill()


def publish_drives(robot):
    """Publish three latched messages, and return their class and the attached times."""
    drive = demo_classes().demo_msgs.msg.Drive
    publish = robot.publisher("/drive", "demo_msgs/msg/Drive", LATCHED)
    for gear in range(3):
        publish(drive(gear=gear, mode="fast"))


def recorded(address, number=signal.SIGINT, path="drive.mcap"):
    """Record /drive until three messages are in the file; return what was written to stderr."""
    with started("record", address, "-o", path, "/drive") as process:
        assert read_line(process.stderr).startswith("recording to ")
        sizes = {0}

        def has_grown():
            assert process.poll() is None
            sizes.add(Path(path).stat().st_size)
            return len(sizes) == 2  # the definitions with the messages that waited for them

        wait_for(has_grown)
        process.send_signal(number)
        assert process.wait(LONG) == 0
        return process.stderr.read()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
@pytest.mark.parametrize("number", SIGNALS)
def test_a_recording_is_complete_after_a_signal(robot, address, number):
    publish_drives(robot)
    assert recorded(address, number) == "/drive: 3 messages → drive.mcap\n"
    assert [m.ros_msg.gear for m in read_ros2_messages("drive.mcap")] == [0, 1, 2]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
@pytest.mark.parametrize("number", SIGNALS)
def test_echo_ends_at_once_with_whole_lines(robot, address, number):
    publish = robot.publisher("/words", "std_msgs/msg/String", LATCHED)
    publish(standard("std_msgs/msg/String")(data="one"))
    with started("echo", address, "/words", "--format", "json") as process:
        assert json.loads(read_line(process.stdout)) == {"data": "one"}
        process.send_signal(number)
        # without a handler, SIGTERM ends a filter as it ends `cat`
        assert process.wait(LONG) == (0 if number == signal.SIGINT else -number)
        assert (process.stdout.read(), process.stderr.read()) == ("", "")


def test_a_recording_is_read_by_other_libraries_and_by_idlc(robot, address, capsys):
    highlevel = pytest.importorskip("rosbags.highlevel")
    publish_drives(robot)
    recorded(address)
    with highlevel.AnyReader([Path("drive.mcap")]) as reader:
        (connection,) = reader.connections
        assert (connection.topic, connection.msgtype) == ("/drive", "demo_msgs/msg/Drive")
        messages = [*reader.messages()]
        decoded = [reader.deserialize(data, connection.msgtype) for *_, data in messages]
    assert [(message.gear, message.mode) for message in decoded] == [(n, "fast") for n in range(3)]
    log_times = [time for _, time, _ in messages]
    own = [*read_ros2_messages("drive.mcap")]
    assert [message.log_time_ns for message in own] == log_times == sorted(log_times)
    assert [message.sequence_count for message in own] == [1, 2, 3]
    assert all(message.publish_time_ns <= message.log_time_ns for message in own)
    assert main(["show", "drive.mcap", "--format", "json"]) == 0
    documents = map(json.loads, capsys.readouterr().out.splitlines())
    (facts,) = (document for document in documents if document["type"] == "topic")
    assert (facts["name"], facts["messages"]) == ("/drive", 3)
    assert facts["hash"].startswith("RIHS01_")
    assert main(["columns", "drive.mcap", "/drive", "--fields", "gear", "-o", "drive.csv"]) == 0
    lines = Path("drive.csv").read_text(encoding="utf-8").splitlines()
    assert [line.rpartition(",")[2] for line in lines] == ['"gear"', "0", "1", "2"]


def complete(*words):
    """Return what bash is told when the last of `words` is to be completed."""
    done = subprocess.run(
        [sys.executable, "-m", "idlc"],
        capture_output=True,
        text=True,
        check=False,
        env={
            **os.environ,
            "_IDLC_COMPLETE": "bash_complete",
            "COMP_WORDS": shlex.join(("idlc", *words)),
            "COMP_CWORD": str(len(words)),
        },
    )
    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    return [line.partition(",")[2] for line in done.stdout.split()]


def test_names_and_fields_are_completed_from_the_robot(robot, address):
    gear = demo_classes().demo_msgs.srv.Gear
    robot.publisher("/words", "std_msgs/msg/String")
    robot.publisher("/wheels", "demo_msgs/msg/Wheel")
    robot.service("/gear", "demo_msgs/srv/Gear", gear, lambda _: gear.Response())
    # on a busy machine, the shell waits in vain
    wait_for(lambda: complete("echo", address, "/w") == ["/wheels", "/words"])
    wait_for(lambda: complete("record", address, "-o", "x.mcap", "/wo") == ["/words"])
    wait_for(lambda: complete("call", address, "/g") == ["/gear"])
    wait_for(lambda: complete("call", address, "/gear", "") == ["gear=", "wheel."])
    wait_for(lambda: complete("call", address, "/gear", "gear=1", "wheel.s") == ["wheel.speed="])
    assert complete("call", address, "/gear", "wheel.none.") == []
    assert complete("call", address, "/no_such", "") == []
    assert complete("echo", "tcp/127.0.0.1:1", "/") == []
