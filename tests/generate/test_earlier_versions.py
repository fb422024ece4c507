"""Packages with another runtime beside packages of today, as packages of another version have it.

An idlc from before the first release generated those in earlier.tar.xz: `outlines` (messages, a
service, an action), `canvas`, whose messages hold brushes/msg/Brush, and `logged` with the
`std_msgs` and `builtin_interfaces` that it uses.
"""

import shutil
from pathlib import Path

import pytest

from tests.generate.test_vendoring import gen, only_numpy, prints, write  # noqa: F401 (a fixture)
from tests.support import generated

EARLIER = Path(__file__).with_name("earlier.tar.xz")
BRUSH = {"msg/Brush.msg": "uint8[3] color\nfloat32 width 2.0\nwstring name\n"}
ROBOT = {
    "msg/Plan.msg": "outlines/Path[] paths\noutlines/Point2 goal\ncanvas/Canvas canvas\n",
    "srv/Ask.srv": "outlines/Path path\n---\noutlines/Point2 nearest\n",
}
UUID = {"msg/UUID.msg": "uint8[16] uuid\n"}
SHAPES = {
    "msg/Point2.msg": "float64 x\nfloat64 y 1.5\nstring label\n",
    "msg/Path.msg": "Point2[] points\nint32[<=4] marks\nfloat32[3] weights\n"
    "builtin_interfaces/Time stamp\n",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with packages of both versions."""
    folder = tmp_path_factory.mktemp("versions")
    shutil.unpack_archive(EARLIER, folder)
    for types in folder.glob("*/_idlc/type_data.py"):  # the first release expects them elsewhere
        shutil.copy(types, types.parents[1] / "_type_data.py")
    generated.write_package(folder, "brushes", BRUSH)
    generated.write_package(folder, "unique_identifier_msgs", UUID)
    for name, files in (("robot", ROBOT), ("noted", {"msg/Note.msg": "std_msgs/Header header\n"})):
        write(folder / "files" / name, files)
    files = folder / "files"
    write(files / "outlines", SHAPES)
    write(files / "canvas", {"msg/Canvas.msg": "brushes/Brush brush\nbrushes/Brush[] others\n"})
    write(files / "brushes", BRUSH)
    gen(files / "robot", folder / "robot", "-I", str(files), package="robot")
    gen(files / "noted", folder / "noted", "--vendor-deps", package="noted")
    return folder


VALUES = """
from brushes.msg import Brush
from builtin_interfaces.msg import Time
from canvas.msg import Canvas
from robot.msg import Plan
from robot.srv import Ask
from outlines.msg import Path, Point2

path = Path(points=[Point2(x=1.0, label="ä"), Point2()], marks=[1, 2], stamp=Time(sec=3))
brush = Brush(color=[1, 2, 3], name="wide")
canvas = Canvas(brush=brush, others=[Brush(), brush], check_fields=True)
plan = Plan(paths=[path], goal=path.points[0], canvas=canvas, check_fields=True)
"""


def test_each_holds_values_of_the_other(folder, only_numpy):  # noqa: F811
    check = """
import copy, pickle
for value in (path, canvas, plan, Ask.Request(path=path), Ask.Response(nearest=Point2(y=2.0))):
    kind = type(value)
    for other in (
        kind.deserialize(value.serialize()),
        kind.from_dict(value.to_dict()),
        pickle.loads(pickle.dumps(value)),
        copy.deepcopy(value),
    ):
        assert type(other) is kind and other == value and repr(other) == repr(value)
    value.validate()
back = Plan.deserialize(plan.serialize())
assert type(back.paths[0]) is Path and type(back.canvas.brush) is Brush
"""
    assert prints(VALUES + check, folder, only_numpy) == []


def test_each_refuses_wrong_values_of_the_other(folder, only_numpy):  # noqa: F811
    check = """
for make in (
    lambda: Plan(goal=path, check_fields=True),
    lambda: Canvas(brush=path.points[0], check_fields=True),
    lambda: Canvas(brush=Brush(color=[1, 2, "far"]), check_fields=True).validate(),
    lambda: Plan(goal=Point2(x="far")).validate(),
    lambda: Plan(goal=Point2(x="far")).serialize(),
    lambda: Plan.deserialize(plan.serialize()[:-3]),
    lambda: Canvas.deserialize(canvas.serialize()[:-3]),
):
    try:
        make()
    except Exception as error:
        print(type(error).__name__)
    else:
        print("accepted")
"""
    checks = ["FieldCheckError", "FieldCheckError", "ValidationError"]
    coding = ["FieldTypeError", "FieldTypeError", "DecodeError", "DecodeError"]
    assert prints(VALUES + check, folder, only_numpy) == checks + coding


def test_bytes_and_hashes_are_those_of_one_version(folder, only_numpy, tmp_path):  # noqa: F811
    """The same files, all generated today, give the same bytes and the same hashes."""
    say = """
print(plan.serialize().hex())
from robot._idlc.typeinfo import type_hash
print(type_hash(Plan))
"""
    generated.write_package(tmp_path, "brushes", BRUSH)
    for name in ("outlines", "canvas", "robot"):
        files = folder / "files"
        gen(files / name, tmp_path / name, "-I", str(files), package=name)
    time = {"msg/Time.msg": "int32 sec\nuint32 nanosec\n"}
    generated.write_package(tmp_path, "builtin_interfaces", time)
    assert prints(VALUES + say, folder, only_numpy) == prints(VALUES + say, tmp_path, only_numpy)


def test_libraries_share_the_types_that_they_use(folder, only_numpy):  # noqa: F811
    """The `std_msgs` beside `logged` is the one that `noted` finds, too."""
    check = """
from logged.msg import Reading
from noted.msg import Note
import noted.vendor.std_msgs, std_msgs.msg
header = std_msgs.msg.Header(frame_id="map")
assert noted.vendor.std_msgs.msg.Header is std_msgs.msg.Header
note = Note(header=Reading(header=header, value=1.0).header, check_fields=True)
assert Note.deserialize(note.serialize()) == note and note.header == header
"""
    assert prints(check, folder, only_numpy) == []


def test_services_and_actions_of_before(folder, only_numpy):  # noqa: F811
    check = """
from outlines.action import Drive
from outlines.srv import Move
goal = Drive.Goal(goal=Point2(x=2.0))
assert Drive.Goal.deserialize(goal.serialize()) == goal
assert Move.Request(goal=goal.goal) == Move.Request(goal=Point2(x=2.0))
feedback = Drive.Impl.FeedbackMessage(feedback=Drive.Feedback(progress=0.5))
assert type(feedback).deserialize(feedback.serialize()) == feedback
"""
    assert prints(VALUES + check, folder, only_numpy) == []
