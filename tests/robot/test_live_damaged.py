"""Robots whose nodes describe their types damaged, ten at a time, late, or never."""

import json
import threading
from pathlib import Path

import pytest
from mcap.reader import make_reader

from idlc.api.recording import Recording
from idlc.cli.main import main
from idlc.robot.keys import EntityKind
from idlc.robot.live.connect import Inbox
from idlc.robot.live.recorder import Recorder
from idlc.robot.qos import DurabilityPolicy, HistoryPolicy, QoSProfile
from tests.robot.fake import DESCRIBE, Robot, demo_classes, standard, write_files

LATCHED = QoSProfile(depth=5, durability=DurabilityPolicy.TRANSIENT_LOCAL)
FILES = {
    "msg/Limit.msg": "# angle in °\nfloat64 angle\nint32 LIMIT=1000000000",
    "msg/Retry.msg": "# angle in °\nfloat64 angle\nint32 retries 1234567890",
    "msg/Tab.msg": (
        "uint8 IDLE=0\t# resting\nuint8 MOVING=1\t# driving\n"
        "uint8 state 1\t# one of the above\nfloat64 limit 2.5\n"
    ),
    "srv/Ask.srv": "int32 MAX=5\nint64 a 3  # in °\n---\nuint8 OK=1\nbool done\n",
}


@pytest.fixture(autouse=True)
def _in_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def robot(address):
    robot = Robot(address, files=FILES)
    robot.describe_types(like_rosidl=True)
    for name in ("Limit", "Retry", "Tab"):
        robot.publisher(f"/{name.lower()}", f"demo_msgs/msg/{name}")
    yield robot
    robot.close()


def test_nothing_wrong_is_taken_from_damaged_definitions(robot, address, capsys):
    assert main(["gen", address, "-o", "out"]) == 0
    texts = {
        path.stem: path.read_text(encoding="utf-8")
        for path in Path("out/demo_msgs/msg").glob("_*.py")
    }
    assert "LIMIT" not in texts["_limit"]
    assert "1234567890" in texts["_retry"]
    assert "MOVING" in texts["_tab"]
    assert "2.5" in texts["_tab"]
    err = capsys.readouterr().err
    assert "constants, default values and comments may be missing in `demo_msgs/msg/Limit`" in err
    assert "-I DIR" in err
    assert main(["show", address, "/limit"]) == 0
    assert "LIMIT" not in capsys.readouterr().out


def test_definitions_with_constants_are_taken_from_this_machine(robot, address, capsys):
    write_files("mine", FILES)
    assert main(["gen", address, "-o", "out", "-I", "mine"]) == 0
    assert "LIMIT" in Path("out/demo_msgs/msg/_limit.py").read_text(encoding="utf-8")
    assert "missing" not in capsys.readouterr().err


def test_what_is_missing_is_no_change(robot, address, capsys):
    longer = {name: f"{text}\nint8 more\n" for name, text in FILES.items() if "msg" in name}
    write_files("mine", longer)
    assert main(["breaking", "mine", "--against", address]) == 1
    out = capsys.readouterr().out
    assert "field `more` was added" in out
    assert "constant `" not in out
    assert "default" not in out.replace("constants and default values of", "")
    assert "idlc compares no constants and default values of `demo_msgs/msg/Limit`" in out


def test_a_node_is_asked_again_for_what_it_dropped(address, capsys):
    files = {f"msg/T{number}.msg": f"int32 f{number}\n" for number in range(40)}
    robot = Robot(address, files=files)
    robot.describe_types(like_rosidl=True)
    for number in range(40):
        robot.publisher(f"/t{number}", f"demo_msgs/msg/T{number}")
    assert main(["check", address]) == 0
    assert "no problems" in capsys.readouterr().out
    robot.close()


def silent(router, node):
    """Return a robot that has a type of its own, and holds all questions for ever."""
    robot = Robot(router, node=node, files={"msg/Own.msg": "int8 own\n"})
    entity = robot.announce(EntityKind.SERVICE, f"/{node}/get_type_description", DESCRIBE)
    robot.declared.append(robot.transport.service(entity, robot.requests.append))
    return robot


def is_asking():
    return any("_ask" in thread.name for thread in threading.enumerate())


def test_no_silent_node_costs_a_message_or_a_second(router, capsys, monkeypatch):
    """A fast valid publisher, beside nodes that are silent, announce ever more topics, or die."""
    quiet, babbling, dying = (silent(router, node) for node in ("quiet", "babbling", "dying"))
    fast = Robot(router, node="fast")
    # with another history, Zenoh drops messages if the router has no time
    every = QoSProfile(history=HistoryPolicy.KEEP_ALL)
    publish = fast.publisher("/words", "std_msgs/msg/String", every)
    for robot in (quiet, dying):
        robot.publisher(f"/{robot.node}", "demo_msgs/msg/Own")(b"\0\1\0\0\5")
    message = standard("std_msgs/msg/String")(data="x" * 1000)
    steps, arrivals, run, put = iter(range(10_000)), [], Recorder.run, Inbox.put

    def is_over():
        step = next(steps)
        if step % 10 == 0:
            babbling.announce(EntityKind.PUBLISHER, f"/b{step}", "demo_msgs/msg/Own", wait=False)
        if step >= 200:
            return len(arrivals) >= 2000 and is_asking()
        if step == 100:
            dying.close()
        for _ in range(10):
            publish(message)
        return False

    def count(inbox, number, sample):
        put(inbox, number, sample)
        if sample is not None and len(sample.payload) > 1000:
            arrivals.append(number)

    def started(recorder, _):
        run(recorder, lambda: fast.observer.graph.count(EntityKind.SUBSCRIPTION, "/words") > 0)
        run(recorder, is_over)

    monkeypatch.setattr("idlc.robot.live.recorder.TICK", 0.02)
    monkeypatch.setattr("idlc.robot.live.recorder.LOOK", 0.05)
    monkeypatch.setattr(Recorder, "run", started)
    monkeypatch.setattr(Inbox, "put", count)
    assert main(["record", router, "-o", "a.mcap", "--duration", "60"]) == 0
    err = capsys.readouterr().err
    assert "/words: 2,000 messages" in err
    assert "`/quiet`" in err
    assert "recorded without the definition of demo_msgs/msg/Own" in err
    assert "lost" not in err
    assert is_asking(), "it did not wait for the nodes that were asked"
    with Recording("a.mcap") as recording:
        assert sum(1 for _ in recording["/words"].messages()) == 2000
    for robot in (quiet, babbling, fast):
        robot.close()


def test_the_time_without_a_robot_is_in_the_file(router, capsys, monkeypatch):
    """A robot that goes away and comes back, as behind a router that restarts."""
    robots = [Robot(router)]
    publish = robots[0].publisher("/words", "std_msgs/msg/String", LATCHED)
    publish(standard("std_msgs/msg/String")(data="before"))
    run, note, steps = Recorder.run, Recorder._note_gap, iter(range(1000))

    def went_away(recorder, is_there):
        note(recorder, is_there)
        if not is_there and len(robots) == 1:
            robots.append(Robot(router))
            robots[1].publisher("/words", "std_msgs/msg/String", LATCHED)
        elif is_there and len(robots) == 2:
            robots.append(None)  # the gap is over

    def is_over():
        if next(steps) == 20:
            robots[0].close()
        return robots[-1] is None

    monkeypatch.setattr("idlc.robot.live.recorder.LOOK", 0.05)
    monkeypatch.setattr("idlc.robot.live.recorder.TICK", 0.05)
    monkeypatch.setattr(Recorder, "_note_gap", went_away)
    monkeypatch.setattr(Recorder, "run", lambda recorder, _: run(recorder, is_over))
    assert main(["record", router, "-o", "a.mcap"]) == 0
    assert "note: the robot was not there for " in capsys.readouterr().err
    with Path("a.mcap").open("rb") as file:
        (gap,) = make_reader(file).iter_metadata()
    begin, end = int(gap.metadata["from"]), int(gap.metadata["to"])
    assert (gap.name, begin < end) == ("idlc gap", True)
    robots[1].close()


def test_an_empty_recording_fails_and_names_the_domain_with_nodes(router, capsys):
    robot = Robot(router, domain=5)
    assert main(["record", router, "-o", "a.mcap", "--duration", "0.1"]) == 1
    err = capsys.readouterr().err
    assert "`a.mcap` contains no messages because there is no topic" in err
    assert "there is no node in domain 0; domain 5 has 1 node; set ROS_DOMAIN_ID" in err
    robot.close()


def test_messages_that_cannot_be_read_are_named_at_once_and_counted(router, capsys):
    robot = Robot(router)
    publish = robot.publisher("/words", "std_msgs/msg/String", LATCHED)
    publish(b"\0\x07\0\0\1\0\0\0\0")
    publish(b"\0\1\0\0\xff")
    assert main(["echo", router, "/words", "--count", "2"]) == 0
    err = capsys.readouterr().err
    assert "messages of `/words` are encoded as PLAIN_CDR2 (XCDR2)" in err
    assert "note: a message is malformed: " in err
    assert "2 malformed messages of `/words`" in err
    robot.close()


def test_types_of_robots_without_hashes_are_those_of_this_machine(router, capsys):
    """Humble announces no hashes."""
    write_files("mine")
    robot = Robot(router)
    publish = robot.publisher("/wheel", "demo_msgs/msg/Wheel", LATCHED, hash_="")
    publish(demo_classes().demo_msgs.msg.Wheel(speed=2.5))
    words = ["echo", router, "/wheel", "--count", "1", "--format", "json"]
    assert main(words) == 1
    assert "-I DIR" in capsys.readouterr().err
    assert main([*words, "-I", "mine"]) == 0
    assert json.loads(capsys.readouterr().out) == {"speed": 2.5, "code": [0, 0, 0]}
    assert main(["record", router, "-o", "a.mcap", "-I", "mine", "--duration", "1"]) == 0
    assert "this machine's definition of demo_msgs/msg/Wheel" in capsys.readouterr().err
    with Recording("a.mcap") as recording:
        assert [each.message.speed for each in recording["/wheel"].messages()] == [2.5]
    robot.close()
