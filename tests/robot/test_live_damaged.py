"""A robot whose nodes describe their types as those of ROS 2 do: damaged, ten at a time."""

from pathlib import Path

import pytest

from idlc.cli.main import main
from tests.robot.fake import Robot, write_files

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
