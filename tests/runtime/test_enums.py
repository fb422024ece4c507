"""Constants as enums in generated classes, and fields that are deprecated."""

import copy
import dataclasses
import enum
import json
import pickle
import sys
import typing
from pathlib import Path

import msgspec
import numpy as np
import pytest
import yaml

from idlc.check import style
from idlc.cli.main import main
from idlc.model import enums
from tests.support import generated
from tests.support.files import write_all

DRIVE = """\
uint8 MODE_IDLE=0     # Standing still.
uint8 MODE_MOVING=1
uint8 SPEED_MAX=9
uint8 mode
uint8 last            # idlc: enum(MODE_*)
uint8[] plan          # idlc: enum(MODE_*)
uint8 speed
float64 velocity 0.5  # deprecated: use speed
float32[] speeds      # deprecated: use speed
"""
FILES = {"msg/Drive.msg": DRIVE, "msg/Fleet.msg": "Drive[] drives\n"}


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("enums")
    generated.write_package(folder, "fleet_msgs", FILES)
    with generated.importable(folder):
        yield folder


@pytest.fixture
def drive_class():
    return generated.class_of("fleet_msgs/msg/Drive")


def test_members_are_the_constants(drive_class):
    assert {member.name: member for member in drive_class.Mode} == {"IDLE": 0, "MOVING": 1}
    assert drive_class.MODE_MOVING == drive_class.Mode.MOVING == 1
    assert type(drive_class.MODE_MOVING) is int
    assert drive_class.Mode.__doc__ == "The values of `mode`, `last`, `plan` that have names."
    assert not hasattr(drive_class, "Speed")  # nobody asked for it


def test_a_member_is_sent_as_its_number(drive_class):
    mode = drive_class.Mode
    message = drive_class(mode.MOVING, mode.MOVING, plan=[mode.MOVING, 200])
    plain = drive_class(1, 1, plan=[1, 200])
    assert message == plain
    for order in ("little", "big"):
        assert message.serialize(byteorder=order) == plain.serialize(byteorder=order)
    message.validate()
    read = drive_class.deserialize(message.serialize())
    assert read == message
    assert type(read.mode) is int
    match read:
        case drive_class(mode.IDLE):
            raise AssertionError
        case drive_class(mode.MOVING, last=mode.MOVING):
            pass
        case _:
            raise AssertionError
    match read.mode:
        case mode.MOVING:
            pass
        case _:
            raise AssertionError


def test_numbers_without_a_name_stay_possible(drive_class):
    message = drive_class(mode=77)
    assert drive_class.deserialize(message.serialize()).mode == 77
    with pytest.raises(ValueError, match="77 is not a valid"):
        drive_class.Mode(message.mode)


def test_wrong_values_are_refused_as_ever(drive_class):
    with pytest.raises(TypeError, match="mode"):
        drive_class("idle")
    with pytest.raises(TypeError, match="mode"):
        drive_class(drive_class.Mode)
    checked = drive_class(drive_class.Mode.MOVING, check_fields=True)
    checked.last = drive_class.Mode.IDLE
    with pytest.raises(AssertionError, match="last"):
        checked.last = 256
    with pytest.raises(ValueError, match="last"):
        drive_class(last=256).validate()


def test_copies_dictionaries_and_texts(drive_class):
    message = drive_class(drive_class.Mode.MOVING, last=drive_class.Mode.IDLE, velocity=2.0)
    values = message.to_dict()
    assert (type(values["mode"]), values["mode"], values["velocity"]) == (int, 1, 2.0)
    assert json.loads(json.dumps(values)) == yaml.safe_load(yaml.safe_dump(values)) == values
    assert msgspec.json.decode(msgspec.json.encode(message.mode)) == 1
    assert drive_class.from_dict(values) == message
    for other in (copy.copy(message), copy.deepcopy(message), dataclasses.replace(message)):
        assert other == message
        assert other.mode is drive_class.Mode.MOVING
    assert "mode=<Mode.MOVING: 1>" in repr(message)


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_pickles(drive_class, protocol):
    message = drive_class(drive_class.Mode.MOVING, velocity=2.0)
    other = pickle.loads(pickle.dumps(message, protocol))
    assert other == message
    assert other.mode is drive_class.Mode.MOVING


def test_columns_compare_with_members(drive_class):
    import pandas as pd

    messages = [drive_class(mode, plan=[mode]).serialize() for mode in (0, 1, 1, 9)]
    columns = drive_class.to_columns(messages)
    assert np.count_nonzero(columns["mode"] == drive_class.Mode.MOVING) == 2
    frame = pd.DataFrame({"mode": columns["mode"]})
    assert list(frame[frame["mode"] == drive_class.Mode.IDLE].index) == [0]


def test_annotations_can_be_evaluated(drive_class):
    hints = typing.get_type_hints(drive_class)
    assert hints["mode"] == drive_class.Mode | int
    assert hints["velocity"] is float
    fields = {field.name: field for field in dataclasses.fields(drive_class)}
    assert list(fields) == ["mode", "last", "plan", "speed", "velocity", "speeds"]
    assert (fields["velocity"].type, fields["velocity"].default) == (float, 0.5)


def test_pydantic_takes_members_and_any_number(drive_class):
    import pydantic

    adapter = pydantic.TypeAdapter(drive_class)
    for value in (1, 77, drive_class.Mode.MOVING):
        message = adapter.validate_python({"mode": value, "velocity": 1.0})
        assert (message.mode, message.velocity) == (value, 1.0)
        assert json.loads(adapter.dump_json(message))["mode"] == value
    with pytest.raises(pydantic.ValidationError):
        adapter.validate_python({"mode": 256})


def test_deprecated_fields_work_as_others(drive_class):
    message = drive_class(velocity=2.0, speeds=[1])
    assert (message.velocity, list(message.speeds)) == (2.0, [1.0])
    message.speeds = range(2)
    message.velocity = 3.0
    assert message != drive_class(velocity=2.0, speeds=range(2))
    assert drive_class.deserialize(message.serialize()) == message
    assert drive_class().velocity == drive_class.VELOCITY__DEFAULT == 0.5
    assert drive_class.__match_args__[-2:] == ("velocity", "speeds")


def test_wire_and_hash_do_not_depend_on_comments(tmp_path, drive_class):
    bare = "".join(f"{line.partition('#')[0].rstrip()}\n" for line in DRIVE.splitlines())
    generated.write_package(tmp_path, "fleet_msgs", {**FILES, "msg/Drive.msg": bare})
    message = drive_class(1, velocity=2.0)
    expected = message.serialize(), generated.type_data(folder_of(drive_class))["hashes"]
    with generated.importable(tmp_path):
        other = generated.class_of("fleet_msgs/msg/Drive")
        assert not hasattr(other, "Mode")
        found = other(1, velocity=2.0).serialize(), generated.type_data(tmp_path / "fleet_msgs")
        assert (found[0], found[1]["hashes"]) == expected


def folder_of(kind):
    return Path(sys.modules[kind.__module__].__file__).parents[1]


SETTINGS = "[tool.idlc]\npaths = ['interfaces']\nout = 'out/drive_msgs'\nenums = {}\n"
PLAIN = "uint8 MODE_IDLE=0\nuint8 MODE_MOVING=1\nuint8 SPEED_MAX=9\nuint8 mode\nuint8 speed\n"


def test_settings_give_all_fields_enums(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    files = {
        "interfaces/msg/Drive.msg": PLAIN + "std_msgs/Header header\n",
        "interfaces/srv/Steer.srv": "---\nint8 RESULT_A=0\nint8 RESULT_B=1\nint8 result\n",
        "pyproject.toml": SETTINGS.format("false"),
    }
    write_all(files)
    run = ["gen", "--package", "drive_msgs", "--vendor-deps"]
    assert main(run) == 0
    module = tmp_path / "out/drive_msgs/msg/_drive.py"
    assert "IntEnum" not in module.read_text()
    before = {path.name: path.read_bytes() for path in module.parent.glob("*.py")}
    (tmp_path / "pyproject.toml").write_text(SETTINGS.format("true"))
    assert main([*run, "--check"]) == 1
    assert "it was written without `enums = true`" in capsys.readouterr().err
    assert main(run) == 0
    text = module.read_text()
    assert "    mode: Drive.Mode | int\n" in text
    assert "class Speed" not in text  # one constant is no choice
    assert (
        "result: Steer_Response.Result | int" in (module.parents[1] / "srv/_steer.py").read_text()
    )
    capsys.readouterr()
    assert main(run) == 0
    assert "unchanged" in capsys.readouterr().out
    (tmp_path / "pyproject.toml").write_text(SETTINGS.format("false"))
    assert main(run) == 0
    assert {path.name: path.read_bytes() for path in module.parent.glob("*.py")} == before


def test_packages_beside_it_get_none(tmp_path, monkeypatch):
    """Everybody who has the package gets the same classes, whoever wrote it."""
    monkeypatch.chdir(tmp_path)
    others = "action_msgs/GoalStatus goal\nother_msgs/Part part\n"
    files = {
        "interfaces/msg/Drive.msg": PLAIN + others,
        "others/other_msgs/msg/Part.msg": "uint8 KIND_A=1\nuint8 kind  # idlc: enum\n",
        "pyproject.toml": SETTINGS.format("true"),
    }
    write_all(files)
    for option in ("--vendor-deps=beside", "--vendor-deps"):
        assert main(["gen", "--package", "drive_msgs", "-I", "others", option]) == 0
        assert "IntEnum" in (tmp_path / "out/drive_msgs/msg/_drive.py").read_text()
        (goal,) = tmp_path.rglob("_goal_status.py")
        assert "IntEnum" not in goal.read_text()
        (part,) = tmp_path.rglob("_part.py")  # the whole package has what it asks for itself
        assert ("IntEnum" in part.read_text()) == (option == "--vendor-deps=beside")


def test_a_wrong_setting_is_a_problem(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_all({"interfaces/msg/Drive.msg": PLAIN, "pyproject.toml": SETTINGS.format("'yes'")})
    assert main(["gen"]) == 2
    assert "`enums` in [tool.idlc] must be true or false" in capsys.readouterr().err


ODD = """\
uint8 A_1=1
uint8 A_A_1=2
uint8 A_A=3
uint8 A1=4
uint8 K=5
uint8 K_X=6
int64 K_LOW=-9223372036854775808
uint64 K_HIGH=18446744073709551615
uint8 NONE_X=1
uint8 TYPE_CHECKING=1
uint8 HEADER_X=1
uint8 ODD_X=1
uint8 INT_X=1
uint8 VALIDATE_X=1
uint8 VALUE_NAME=1
uint8 VALUE_VALUE=2

uint8 a        # idlc: enum
uint8 a_1      # idlc: enum(A1)
uint8 a1       # idlc: enum(A_A)
int64 k        # idlc: enum
uint64 high    # idlc: enum(K_HIGH)
uint8 none     # idlc: enum
uint8 header   # idlc: enum  deprecated: no
std_msgs/Header stamp
uint8 odd      # idlc: enum
char int       # idlc: enum
uint8 validate # idlc: enum
# Above it.
# idlc: enum( VALUE_NAME,VALUE_VALUE
# deprecated: '''\"\"\"{{ 1 }}
uint8[2] value
"""


def test_odd_names(tmp_path):
    generated.write_package(tmp_path, "odd_msgs", {"msg/Odd.msg": ODD})
    generated.write_package(tmp_path, "std_msgs", generated.catalog_files()["std_msgs"])
    basics = "builtin_interfaces"
    generated.write_package(tmp_path, basics, generated.catalog_files()[basics])
    with generated.importable(tmp_path):
        odd = generated.class_of("odd_msgs/msg/Odd")
        header = generated.class_of("std_msgs/msg/Header")
        found = {
            name: {member: int(value) for member, value in kind.__members__.items()}
            for name, kind in vars(odd).items()
            if isinstance(kind, enum.EnumMeta)
        }
        assert found == {
            "A": {"A_1": 1, "A_A_1": 2},
            "A1_": {"A1": 4},
            "A1__": {"A_A": 3},
            "K_": {"X": 6, "LOW": -(2**63)},
            "High": {"K_HIGH": 2**64 - 1},
            "None_": {"X": 1},
            "Header_": {"X": 1},
            "Odd_": {"X": 1},
            "Int": {"X": 1},
            "Validate": {"X": 1},
            "Value": {"VALUE_NAME": 1, "VALUE_VALUE": 2},
        }
        assert typing.get_type_hints(odd)["stamp"] is header
        assert typing.get_type_hints(odd)["header"] == odd.Header_ | int
        message = odd(**{name: 1 for name in odd.__match_args__ if name not in ("stamp", "value")})
        assert odd.deserialize(message.serialize()) == message


def test_enums_of_many_constants_take_no_longer_than_they_are_long():
    """A mark for each field, each constant in one enum only."""
    count = 3000
    lines = (f"uint16 A_{n}={n}\nuint16 a_{n}  # idlc: enum(A_*, A_{n})\n" for n in range(count))
    text = "".join(lines)
    (message,) = generated.model_of("many_msgs", {"msg/Many.msg": text}).own
    made = list(enums.enums(message, "all"))
    assert sum(len(each.members) for each in made) == count
    assert len(made) == count
    assert made[7].name == "A7"


@pytest.mark.parametrize(("count", "has_enum"), [(enums.MOST, True), (enums.MOST + 1, False)])
def test_an_enum_is_not_too_large_to_be_imported(count, has_enum):
    constants = "".join(f"uint16 A_{n}={n}\n" for n in range(count))
    files = {"msg/Many.msg": f"{constants}uint16 a  # idlc: enum\n"}
    model = generated.model_of("many_msgs", files)
    assert bool([*enums.enums(model.own[0])]) == has_enum
    codes = [problem.code for problem in style.enum_marks(model)]
    assert codes == ([] if has_enum else ["IDL492"])
