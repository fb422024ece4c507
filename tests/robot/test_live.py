"""A robot as a source of types, and its messages from the shell."""

import json
import signal
import threading
from contextlib import contextmanager
from pathlib import Path

import pytest
from mcap.reader import make_reader

from idlc.api.recording import Recording
from idlc.cli.main import main
from idlc.robot.keys import EntityKind
from idlc.robot.live.recorder import Recorder
from idlc.robot.qos import DurabilityPolicy, QoSProfile
from tests.robot.fake import FILES, Robot, demo_classes, standard, write_files

LATCHED = QoSProfile(depth=5, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@pytest.fixture(autouse=True)
def _in_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def robot(address):
    with running(address) as robot:
        robot.describe_types()
        yield robot


@contextmanager
def running(address, *arguments):
    robot = Robot(address, *arguments)
    try:
        yield robot
    finally:
        robot.close()


def test_the_types_that_a_robot_uses_are_compiled(robot, address, capsys):
    robot.publisher("/drive", "demo_msgs/msg/Drive")
    robot.publisher("/nothing", "demo_msgs/msg/Nothing")
    robot.announce(EntityKind.SERVICE, "/gear", "demo_msgs/srv/Gear")
    robot.action("/move", "demo_msgs/action/Move")
    assert main(["gen", address, "-o", "out"]) == 0
    assert "demo_msgs: 32 files from 5 interfaces" in capsys.readouterr().out
    assert "[m/s]" in Path("out/demo_msgs/msg/_wheel.py").read_text(encoding="utf-8")
    assert main(["check", address]) == 0
    write_files("mine")
    assert main(["breaking", "mine", "--against", address]) == 0
    write_files("mine", {**FILES, "srv/Gear.srv": "int8 gear\n---\nbool done\n"})
    assert main(["breaking", "mine", "--against", address]) == 1
    out = capsys.readouterr().out
    assert "`demo_msgs/srv/Gear_Request` has 2 versions: in `/driver`; in your files" in out
    assert "field `wheel` was added" in out


def test_definitions_with_another_hash_are_refused(address, capsys):
    service = standard("type_description_interfaces/srv/GetTypeDescription")

    def lie(asked):
        source = {"encoding": "msg", "raw_file_contents": "int8 other\n"}
        return service.Response.from_dict(
            {"successful": True, "type_sources": [{"type_name": asked.type_name, **source}]}
        ).serialize()

    with running(address) as robot:
        robot.describe_types(lie)
        robot.publisher("/drive", "demo_msgs/msg/Drive")
        robot.publisher("/words", "std_msgs/msg/String")
        # the others are there all the same
        assert main(["gen", address, "-o", "out"]) == 1
    assert Path("out/std_msgs").exists()
    assert not Path("out/demo_msgs").exists()
    err = capsys.readouterr().err
    assert "idlc does not read `/drive`: the robot does not define `demo_msgs/msg/Drive`" in err
    assert "`/driver` sends an unusable type description" in err


@pytest.mark.parametrize("reply", [b"", b"\0", b"\0\1\0\0" + b"\xff" * 50, b"x" * 5_000_000])
def test_garbage_instead_of_definitions_is_reported(address, capsys, reply):
    with running(address) as robot:
        robot.describe_types(lambda _: reply)
        robot.publisher("/drive", "demo_msgs/msg/Drive")
        assert main(["check", address]) == 0
    assert "does not define `demo_msgs/msg/Drive`" in capsys.readouterr().out


def test_sources_cannot_name_files(address, tmp_path):
    service = standard("type_description_interfaces/srv/GetTypeDescription")

    def lie(asked):
        names = (asked.type_name, "../../msg/Evil", "a/msg/../../Evil", "/etc/msg/X", "a b/msg/X")
        source = {"encoding": "msg", "raw_file_contents": FILES["msg/Nothing.msg"]}
        return service.Response.from_dict(
            {"successful": True, "type_sources": [{"type_name": n, **source} for n in names]}
        ).serialize()

    with running(address) as robot:
        robot.describe_types(lie)
        robot.publisher("/nothing", "demo_msgs/msg/Nothing")
        assert main(["gen", address, "-o", "out"]) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert not [path for path in Path("out").rglob("*") if "vil" in path.name]


def test_the_graph_is_shown_with_what_does_not_fit(robot, address, capsys):
    robot.publisher("/drive", "demo_msgs/msg/Drive")
    robot.publisher("/nothing", "demo_msgs/msg/Nothing")
    robot.action("/move", "demo_msgs/action/Move")
    with running(address, "teleop", {**FILES, "msg/Drive.msg": "int8 x\n"}) as other:
        other.announce(EntityKind.SUBSCRIPTION, "/drive", "demo_msgs/msg/Drive")
        other.announce(EntityKind.SUBSCRIPTION, "/nothin", "demo_msgs/msg/Nothing")
        other.announce(EntityKind.SUBSCRIPTION, "/hum", "demo_msgs/msg/Humble", "")
        assert main(["show", address]) == 0
        text = capsys.readouterr().out
        assert main(["show", address, "--format", "json"]) == 0
        facts = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert "mismatch: /drive: /driver → /teleop differ in hash" in text
    assert "similar names: /nothing has no receiver, and /nothin no sender" in text
    assert {"type": "node", "name": "/teleop"} in facts
    action = next(fact for fact in facts if fact["type"] == "action")
    assert (action["name"], action["receivers"]) == ("/move", ["/driver"])


def test_a_slow_robot_is_noted(robot, address, capsys, monkeypatch):
    def too_late(*_):
        raise TimeoutError
        yield

    for name in ("zenoh_transport.ZenohTransport", "dds.transport.DdsTransport"):
        monkeypatch.setattr(f"idlc.robot.{name}.entities", too_late)
    assert main(["show", address]) == 0
    assert "the robot answers too slowly; endpoints may be missing" in capsys.readouterr().err


@pytest.mark.parametrize("style", ["yaml", "json", "csv"])
def test_messages_are_printed_and_malformed_ones_counted(robot, address, capsys, style):
    string = standard("std_msgs/msg/String")
    publish = robot.publisher("/words", "std_msgs/msg/String", LATCHED)
    publish(b"\0\1\0\0\xff\xff")
    for word in ("one", "two"):
        publish(string(data=word))
    assert main(["echo", address, "words", "--count", "3", "--format", style]) == 0
    out, err = capsys.readouterr()
    expected = {
        "yaml": "{data: one}\n---\n{data: two}\n---\n",
        "json": '{"data": "one"}\n{"data": "two"}\n',
        "csv": "data\none\ntwo\n",
    }
    assert out == expected[style]
    assert "1 malformed messages" in err


@pytest.mark.parametrize("unread", [3, 4, 12])
def test_messages_that_are_longer_than_their_type_are_noted_once(robot, address, capsys, unread):
    string = standard("std_msgs/msg/String")
    publish = robot.publisher("/words", "std_msgs/msg/String", LATCHED)
    for word in ("one", "two"):
        publish(string(data=word).serialize() + bytes(unread))
    assert main(["echo", address, "words", "--count", "2"]) == 0
    out, err = capsys.readouterr()
    assert out == "{data: one}\n---\n{data: two}\n---\n"
    assert err.count(f"has {unread} bytes that std_msgs/msg/String does not read") == (unread > 3)


def test_fields_are_printed_without_the_rest(robot, address, capsys):
    kind = standard("sensor_msgs/msg/JointState")
    publish = robot.publisher("/joints", "sensor_msgs/msg/JointState", LATCHED)
    for count in (0, 2):
        publish(kind(name=["a", "b"][:count], position=[0.5] * count))
    words = ["echo", address, "/joints", "--count", "2", "--format", "json", "--fields"]
    assert main([*words, "name[1], position,header.stamp"]) == 0
    assert list(map(json.loads, capsys.readouterr().out.splitlines())) == [
        {"name[1]": None, "position": [], "header.stamp": {"sec": 0, "nanosec": 0}},
        {"name[1]": "b", "position": [0.5, 0.5], "header.stamp": {"sec": 0, "nanosec": 0}},
    ]
    assert main([*words, "position.b,velocity.b,position.c,name[0]"]) == 0
    out, err = capsys.readouterr()
    absent = {"position.b": None, "velocity.b": None, "position.c": None, "name[0]": None}
    assert list(map(json.loads, out.splitlines())) == [
        absent,
        {**absent, "position.b": 0.5, "name[0]": "a"},
    ]
    assert err == ""
    assert main([*words, "effort.elbw"]) == 0
    assert main([*words, "name.b"]) == 2
    assert main([*words, "positoin"]) == 2
    assert "did you mean `position`?" in capsys.readouterr().err


def test_unknown_names_and_robots_are_errors(robot, address, capsys):
    robot.publisher("/words", "std_msgs/msg/String")
    assert main(["echo", address, "/word"]) == 2
    assert "did you mean `/words`?" in capsys.readouterr().err
    assert main(["call", address, "/word"]) == 2
    assert main(["record", address, "-o", "a.mcap", "/word"]) == 2
    assert not Path("a.mcap").exists()
    assert main(["show", "ddss"]) == 2
    assert "did you mean `dds`?" in capsys.readouterr().err
    assert main(["show", "tcp/localhost"]) == 2
    assert "IDL642" in capsys.readouterr().err
    assert main(["columns", address]) != 0
    assert "idlc record" in capsys.readouterr().err


def test_requests_are_checked_before_they_are_sent(robot, address, capsys):
    gear = demo_classes().demo_msgs.srv.Gear
    seen = []

    def answer(request):
        seen.append(request)
        return gear.Response(done=True, reason=f"{request.gear} {request.wheel.speed}")

    robot.service("/gear", "demo_msgs/srv/Gear", gear, answer)
    wrong = ("gear=300", "gear=x", "gear", "wheel.x=1", "wheel.code=[1,2]", "gear.x=1", "wheel=1")
    for word in wrong:
        assert main(["call", address, "/gear", word]) == 2, word
    assert seen == []
    capsys.readouterr()
    words = ["gear=3", "wheel.speed=2.5", "wheel.code=[1,2,3]", "--format", "json"]
    assert main(["call", address, "gear", *words]) == 0
    assert json.loads(capsys.readouterr().out) == {"done": True, "reason": "3 2.5"}


def test_a_recording_is_read_by_idlc_and_mcap(robot, address, capsys, monkeypatch):
    drive = demo_classes().demo_msgs.msg.Drive
    publish = robot.publisher("/drive", "demo_msgs/msg/Drive", LATCHED)
    for gear in range(3):
        publish(drive(gear=gear))

    def written(recorder):
        recorder._writer.flush()
        return sum(recorder._writer.counts.values()) == 3

    run, handler = Recorder.run, signal.getsignal(signal.SIGTERM)
    with monkeypatch.context() as patch:
        patch.setattr(
            Recorder,
            "run",
            lambda self, is_over: run(self, lambda: is_over() or written(self)),
        )
        assert main(["record", address, "-o", "a.mcap", "/drive", "--duration", "60"]) == 0
    # it ends in time, and long after the first message even on a busy machine
    assert main(["record", address, "-o", "b.mcap", "/drive", "--duration", "2"]) == 0
    assert Path("b.mcap").stat().st_size > 0
    assert signal.getsignal(signal.SIGTERM) == handler
    with Recording("a.mcap") as recording:
        assert [message.message.gear for message in recording["/drive"]] == [0, 1, 2]
    with Path("a.mcap").open("rb") as file:
        (channel,) = make_reader(file).get_summary().channels.values()
        assert "durability: transient_local" in channel.metadata["offered_qos_profiles"]
        assert channel.metadata["topic_type_hash"].startswith("RIHS01_")
    assert main(["record", address, "-o", "a.mcap", "--duration", "1"]) == 1
    assert "exists" in capsys.readouterr().err


def test_a_robot_with_many_endpoints_is_shown(robot, address, capsys):
    for number in range(2000):
        robot.announce(EntityKind.PUBLISHER, f"/t{number}", "std_msgs/msg/String", wait=False)
    robot.await_count(EntityKind.PUBLISHER, "", 2000)
    assert main(["show", address, "--format", "json"]) == 0
    assert capsys.readouterr().out.count('"type": "topic"') == 2000
    assert threading.active_count() < 100
