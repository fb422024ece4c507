"""Types and packages by name, as people write them: `show` and `list`."""

import json
from pathlib import Path

import pytest

from idlc.cli.main import main
from tests.support.files import write

MANIFEST = '<package format="3"><name>{}</name></package>'


@pytest.fixture(autouse=True)
def workspace(tmp_path, monkeypatch):
    """A workspace with one package, and no ROS but what is built in."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.prefix", str(tmp_path / "no_prefix"))
    write("src/greenhouse/package.xml", MANIFEST.format("greenhouse_msgs"))
    write("src/greenhouse/msg/SensorReading.msg", "std_msgs/Header header\n")
    write("src/greenhouse/msg/Twist.msg", "float32 a\n")
    write("src/greenhouse/srv/Water.srv", "---\n")
    write("src/greenhouse/action/Water.action", "---\n---\n")
    return tmp_path


def hashed(capsys, *words):
    """Return the first name that `idlc show --format hash` prints."""
    assert main(["show", *words, "--format", "hash"]) == 0, capsys.readouterr().err
    return capsys.readouterr().out.split()[1]


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("std_msgs/msg/Header", "std_msgs/msg/Header"),
        ("std_msgs/Header", "std_msgs/msg/Header"),
        ("Header", "std_msgs/msg/Header"),
        ("std_msgs.msg.Header", "std_msgs/msg/Header"),
        ("std_msgs::msg::Header", "std_msgs/msg/Header"),
        ("std_srvs/Trigger", "std_srvs/srv/Trigger"),
        ("std_srvs/Trigger_Response", "std_srvs/srv/Trigger_Response"),
        ("SetCameraInfo_Response", "sensor_msgs/srv/SetCameraInfo_Response"),
        ("Fibonacci_SendGoal_Request", "example_interfaces/action/Fibonacci_SendGoal_Request"),
        ("greenhouse_msgs/SensorReading", "greenhouse_msgs/msg/SensorReading"),
        ("SensorReading", "greenhouse_msgs/msg/SensorReading"),
    ],
)
@pytest.mark.parametrize("folder", [".", "src/greenhouse", "src/greenhouse/msg"])
def test_a_name_that_means_one_type_is_that_type(text, name, folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    assert hashed(capsys, text) == name
    if "_" not in name.rpartition("/")[2]:
        assert main(["show", text]) == 0
        assert capsys.readouterr().out.startswith(f"# {name}\n")
    assert main(["show", text, "--format", "type-description"]) == 0
    assert f'"type_name": "{name}"' in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "hints"),
    [
        ("String", ["can be 2 types", "`example_interfaces/msg/String`, `std_msgs/msg/String`"]),
        ("greenhouse_msgs/Water", ["`greenhouse_msgs/srv/Water`, `greenhouse_msgs/action/Water`"]),
        ("Headr", ["did you mean `std_msgs/msg/Header`?"]),
        ("std_msgs/Headr", ["did you mean `std_msgs/msg/Header`?"]),
        ("std_mgs/Header", ["did you mean `std_msgs/msg/Header`?"]),
        ("scr", ["did you mean `src`?"]),
        ("std_msg", ["did you mean `std_msgs`?"]),
        ("nav2_msgs/NavigateToPose", ["package `nav2_msgs` not found; add its folder with -I"]),
        ("std_msgs/Quaternionnnnn", ["`idlc list std_msgs` lists its types"]),
        ("qqqqqqqqqq", ["no file, folder, package or type named", "`idlc list` lists"]),
        (
            "std_srvs/Trigger_Reply",
            ["the types of `std_srvs/srv/Trigger` are `Trigger_Event`"],
        ),
        ("std_msgs/foo/Header", ["did you mean `std_msgs/msg/Header`?"]),
    ],
)
def test_what_means_none_or_several_leads_on(text, hints, capsys):
    for style in ("text", "hash", "type-description"):
        assert main(["show", text, "--format", style]) == 2
        said = capsys.readouterr().err
        assert "error[IDL618]" in said
        for hint in hints:
            assert hint in said


def test_the_package_around_wins_over_what_is_installed(monkeypatch, capsys):
    monkeypatch.chdir("src/greenhouse")
    assert main(["show", "Twist", "--format", "hash"]) == 2
    assert "`geometry_msgs/msg/Twist`, `greenhouse_msgs/msg/Twist`" in capsys.readouterr().err
    write("package.xml", MANIFEST.format("geometry_msgs"))
    assert main(["show", "geometry_msgs/Twist"]) == 0
    assert "float32 a" in capsys.readouterr().out


def test_a_package_means_all_that_it_holds(capsys):
    assert main(["show", "std_srvs"]) == 0
    assert capsys.readouterr().out.count("# std_srvs/srv/") == 3
    assert main(["show", "greenhouse_msgs", "Header", "--format", "hash"]) == 0
    names = capsys.readouterr().out.split()[1::2]
    assert {"greenhouse_msgs/msg/Twist", "std_msgs/msg/Header"} < set(names)


def test_all_folders_of_a_package_count(monkeypatch, capsys):
    monkeypatch.chdir("src/greenhouse")
    write("more/msg/Extra.msg", "int8 a\n")
    assert main(["list", "greenhouse_msgs"]) == 0
    names = capsys.readouterr().out.split()
    assert {"greenhouse_msgs/msg/Extra", "greenhouse_msgs/msg/Twist"} < set(names)


def test_an_existing_file_is_never_a_type(capsys):
    write("Header", "no interface")
    assert main(["show", "Header"]) == 2
    assert "[IDL605]" in capsys.readouterr().err


def test_the_list_says_what_is_known_and_where_from(capsys, monkeypatch):
    write("opt/share/arm_msgs/msg/Arm.msg", "int8 a\n")
    write("more/leg_msgs/msg/Leg.msg", "int8 a\n")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(Path("opt").absolute()))
    monkeypatch.chdir("src")
    assert main(["list", "-I", "../more"]) == 0
    rows = [line.split(maxsplit=3) for line in capsys.readouterr().out.splitlines()]
    found = {name: (int(number), path) for name, number, _, path in rows}
    assert found["greenhouse_msgs"] == (4, "greenhouse")
    assert found["arm_msgs"][1].endswith("/opt/share/arm_msgs")
    assert found["leg_msgs"][1].endswith("/more/leg_msgs")
    assert found["std_srvs"] == (3, "built in")
    assert main(["list", "arm_msgs", "std_srvs"]) == 0
    assert capsys.readouterr().out.split() == [
        "arm_msgs/msg/Arm",
        *(f"std_srvs/srv/{name}" for name in ("Empty", "SetBool", "Trigger")),
    ]
    assert main(["list", "arm_msg"]) == 2
    assert "did you mean `arm_msgs`?" in capsys.readouterr().err
    assert main(["list", "--format", "json"]) == 0
    facts = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert {"type": "package", "name": "std_srvs", "interfaces": 3, "path": None} in facts
