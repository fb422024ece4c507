"""Each golden/gen/<case>/in compiles to out; out is typed, formatted, clean and works.

`IDLC_REFRESH='gen/*' pytest tests/generate/test_golden_gen.py` rewrites the cases that match, and
fails, so that the changes are looked at. The support package is the same in all cases and not
among them.
"""

import random
import shutil
import subprocess
import sys

import pytest

from idlc.generate.python.render import PACKAGE, render_package
from idlc.model import derive
from idlc.model.distros import BY_NAME, DEFAULT
from idlc.project.lock import COPY_HEAD
from tests.support import generated, refresh, values
from tests.support.paths import GOLDEN

FOLDER = GOLDEN / "gen"
CASES = sorted(path for path in FOLDER.iterdir() if path.is_dir())
EACH = pytest.mark.parametrize("case", CASES, ids=lambda path: path.name)


def package_of(case):
    return f"{case.name}_msgs"


def model_of(case):
    """Return a case's model, for the distribution that it is named after if there is one."""
    files = generated.files_of(case / "in")
    return generated.model_of(package_of(case), files, BY_NAME.get(case.name, DEFAULT))


def outputs(case):
    """Return what is generated for a case, by path, but the support package's modules."""
    model = model_of(case)
    files = {file.path: file.text for file in render_package(model)}
    support = {path for path in files if path.startswith("_idlc/")}
    for path in support:
        source = PACKAGE / "runtime" / path.removeprefix("_idlc/")
        assert files.pop(path) == COPY_HEAD + source.read_text(encoding="utf-8")
    assert len(support) == len(list((PACKAGE / "runtime").rglob("*.py")))
    return files


@EACH
def test_golden_tree(case):
    found = outputs(case)
    out = case / "out"
    if refresh.wanted(f"gen/{case.name}"):
        shutil.rmtree(out, ignore_errors=True)
        for path, text in found.items():
            (out / path).parent.mkdir(parents=True, exist_ok=True)
            (out / path).write_text(text, encoding="utf-8")
        refresh.refreshed()
    wanted = {
        path.relative_to(out).as_posix(): path.read_text(encoding="utf-8")
        for path in out.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert sorted(found) == sorted(wanted)
    for path, text in wanted.items():
        assert found[path] == text, path


@pytest.fixture(scope="module")
def trees(tmp_path_factory):
    """All cases' packages and what they depend on, in one folder."""
    folder = tmp_path_factory.mktemp("trees")
    for case in CASES:
        generated.write_model(folder, model_of(case))
    catalog = generated.catalog_files()
    for package in ("action_msgs", "builtin_interfaces", "geometry_msgs", "service_msgs",
                    "std_msgs", "unique_identifier_msgs"):  # fmt: skip
        generated.write_package(folder, package, catalog[package])
    return folder


@EACH
def test_everything_in_it_is_written_and_read(trees, case):
    model = model_of(case)
    rng = random.Random(case.name)
    with generated.importable(trees):
        for interface in model.own:
            for structure in derive.messages(interface):
                cls = generated.class_of(str(structure.name))
                for _ in range(20):
                    message = values.randomized(cls(), rng)
                    # a field may hide a method
                    methods, class_methods = super(cls, message), super(cls, cls)
                    methods.validate()
                    for order in ("little", "big"):
                        buffer = methods.serialize(byteorder=order)
                        assert class_methods.deserialize(buffer) == message
                    assert class_methods.from_dict(methods.to_dict()) == message


def run(*command, cwd):
    return subprocess.run(
        [sys.executable, "-m", *map(str, command)],
        cwd=cwd,
        capture_output=True,
        text=True,
        check=False,
    )


def assert_formatted(folder):
    result = run("ruff", "format", "--check", "--diff", "--isolated", "--no-cache", ".", cwd=folder)
    assert result.returncode == 0, result.stdout[-3000:] + result.stderr[-300:]


def test_generated_code_is_formatted(trees):
    assert_formatted(trees)


def test_classes_of_the_catalogue_are_formatted(tmp_path):
    for package, files in generated.catalog_files().items():
        generated.write_package(tmp_path, package, files)
    assert_formatted(tmp_path)


def test_generated_code_is_clean(trees):
    # Where C calls Python, nothing at all may be raised; what says so here says it to our rules.
    near_c = [f"**/_idlc/{name}.py" for name in ("c", "fastrtps", "structs", "typesupport")]
    ignored = ",".join(f"{path}:{code}" for path in near_c for code in ("BLE001", "RUF100"))
    through_c = f"--per-file-ignores={ignored}"
    result = run("ruff", "check", "--isolated", "--no-cache", through_c, ".", cwd=trees)
    assert result.returncode == 0, result.stdout[-3000:]
    more = "--extend-select=A004,B,C4,E,F,FURB,I,ISC,PERF,PIE,RET,RSE,S,SIM,UP,W"
    # The base class has the annotation of the types; a line for each field compares it.
    ignored = "--ignore=B905,E501,RUF012,S101,SIM103,SIM201,SIM905"
    # Generated modules only: the support package follows the project's own rules.
    result = run(
        "ruff", "check", "--isolated", "--no-cache", more, ignored,
        "--exclude=_idlc", "--ignore-noqa", ".", cwd=trees,
    )  # fmt: skip
    assert result.returncode == 0, result.stdout[-3000:]


USER_CODE = '''
"""What users write, checked as they would."""

import dataclasses
from array import array

import numpy as np
from comments_msgs.action import Fill, Fill_Feedback, Fill_FeedbackMessage, Fill_SendGoal_Request
from comments_msgs.msg import Gauge
from comments_msgs.srv import Reset, Reset_Event
from enums_msgs.msg import Drive
from enums_msgs.srv import Set
from layouts_msgs.msg import Everything, Inner
from lyrical_msgs.msg import Lists, Words
from names_msgs.msg import Hiding, Odd, Point
from numpy.typing import NDArray
from typing_extensions import assert_type

gauge = Gauge(1.0, 2, label="x", samples=[1, 2], covariance=[0.0] * 9)
gauge.samples = range(3)
gauge.samples = np.zeros(3, np.int16)
gauge.covariance = np.eye(3).ravel()
gauge.notes.append("note")
assert_type(gauge.samples, "array[int]")
assert_type(gauge.rate, float)
assert_type(gauge.flags, bytes)
assert_type(gauge.notes, list[str])
assert_type(Gauge().covariance, "NDArray[np.float64]")
full: int = Gauge.FULL
rate_default: float = Gauge.RATE__DEFAULT
assert_type(Gauge.deserialize(gauge.serialize()), Gauge)
assert_type(Gauge.deserialize(bytearray()), Gauge)
assert_type(Gauge.deserialize(b"", copy=False), Gauge)
assert_type(Gauge.deserialize_many([b"", bytearray()], copy=False), list[Gauge])
assert_type(Gauge.serialize_many(gauge for _ in range(3)), list[bytes])
print(Gauge.to_columns([gauge.serialize()])["value"].mean())
assert_type(Gauge.from_dict(gauge.to_dict()), Gauge)
assert_type(dataclasses.replace(gauge, level=3, samples=[1]), Gauge)
assert_type(Gauge.get_fields_and_field_types(), dict[str, str])
big: bytes = gauge.serialize(byteorder="big")
gauge.validate()

match gauge:
    case Gauge(rate, level=level):
        assert_type(rate, float)
        assert_type(level, int)

everything = Everything(inners=[Inner()], flags=[True], stamps=[])
assert_type(everything.inners[0].c, str)
odd = Odd(class_=1, item=[Point(1.0, 2.0)])
assert_type(odd.class_, int)
assert_type(odd.list, str)
assert_type(odd.str, list[str])
assert_type(odd.item[0].x, float)
hiding = Hiding(Point(1.0), deserialize=[1, 2], from_dict=(1, 2, 3))
assert_type(hiding.validate.x, float)
assert_type(hiding.serialize, int)
assert_type(hiding.deserialize, "array[float]")
assert_type(super(Hiding, hiding).serialize(), bytes)

lists = Lists(names=("a",), words=(Words(text=None, count=None) for _ in range(2)), raw=None)
lists.names.append("b")
lists.flags = (True, False)
lists.names = {"a": 1}.keys()
assert_type(lists.names, list[str])
assert_type(lists.words[0].text, str)
assert_type(lists.raw, list[bytes])
assert_type(Lists().three, list[Words])

drive = Drive(Drive.Mode.MOVING, drive=Drive.Drive_.LEFT, plan=[Drive.Mode.IDLE, 9])
assert_type(Drive.deserialize(drive.serialize()).drive, Drive.Drive_ | int)
assert_type(dataclasses.replace(drive, mode=Drive.Mode.IDLE, previous_mode=7), Drive)
reply = Set.Response(result=Set.Response.Result.FAILED)


def steer(drive: Drive) -> None:
    drive.previous_mode = drive.mode
    drive.mode = 9
    drive.mode = Drive.MODE_IDLE
    drive.mode = Drive.Mode.MOVING
    drive.plan.append(Drive.Mode.IDLE)


def described(drive: Drive) -> str:
    assert_type(drive.mode, Drive.Mode | int)
    if drive.mode == Drive.Mode.IDLE or drive.previous_mode == Drive.MODE_MOVING:
        return Drive.Mode(drive.mode).name
    match drive.mode:
        case Drive.Mode.IDLE:
            return "idle"
        case Drive.MODE_MOVING:
            return "moving"
        case Drive.Mode.MODE_3D:
            return "3d"
        case number:
            return str(number + 1)


request: Reset.Request = Reset.Request(reason="why")
goal: Fill.Goal = Fill.Goal(1.0)
assert_type(request.reason, str)
assert_type(Fill.Impl.SendGoalService.Request().goal.level, float)
assert_type(Fill.Impl.SendGoalService.Request(goal=goal).goal, Fill.Goal)
assert_type(Fill.Impl.SendGoalService.Event().response[0].accepted, bool)
assert_type(Fill.Impl.GetResultService.Response(status=4).result, Fill.Result)
assert_type(Fill.Impl.GetResultService.Event().response[0].result, Fill.Result)
assert_type(Fill_FeedbackMessage().feedback, Fill_Feedback)
assert_type(Reset.Event(request=[request]).request[0].reason, str)
event: Reset.Event = Reset_Event(response=[Reset.Response()])
sent: Fill.Impl.SendGoalService.Request = Fill_SendGoal_Request(goal=goal)
if isinstance(sent, Fill_SendGoal_Request):
    assert_type(sent.deserialize(sent.serialize()).goal, Fill.Goal)
names = [field.name for field in dataclasses.fields(gauge)]
'''

MISTAKES = """
from comments_msgs.action import Fill, Fill_FeedbackMessage
from comments_msgs.msg import Gauge
from enums_msgs.msg import Drive
from lyrical_msgs.msg import Lists, Words

gauge = Gauge("fast")
gauge.level = "full"
gauge.samples = ["a"]
gauge.unknown = 1
gauge.serialize(byteorder="middle")
Gauge(unknown=1)
Words(text=1)
Lists(names=(1,))
Lists().names = [1]
Fill_FeedbackMessage(feedback=1)
Fill_FeedbackMessage().feedback = Fill.Goal()
Fill.Impl.GetResultService.Response(goal_id=None)
Fill.Impl.SendGoalService.Response(accepted="yes")
Drive(mode="idle")
Drive().mode = None
Drive.Mode.FLAG
Drive().mode.name
"""


MISTAKEN = set(range(7, 24))


@pytest.fixture(scope="module")
def user(trees):
    (trees / "user_code.py").write_text(USER_CODE, encoding="utf-8")
    (trees / "mistakes.py").write_text(MISTAKES, encoding="utf-8")
    yield trees
    (trees / "user_code.py").unlink()
    (trees / "mistakes.py").unlink()


@pytest.mark.long
def test_user_code_and_generated_code_pass_mypy_strict(user):
    flags = ["--strict", "--cache-dir", user / ".mypy", "--warn-unreachable"]
    packages = [word for case in CASES for word in ("-p", package_of(case))]
    result = run("mypy", *flags, *packages, "-m", "user_code", cwd=user)
    assert result.returncode == 0, result.stdout[-3000:]
    result = run("mypy", *flags, "mistakes.py", cwd=user)
    assert wrong_lines(result.stdout) == MISTAKEN, result.stdout


@pytest.mark.long
def test_user_code_and_generated_code_pass_basedpyright(user):
    (user / "pyrightconfig.json").write_text('{"typeCheckingMode": "standard"}', encoding="utf-8")
    packages = [package_of(case) for case in CASES]
    flags = ["--pythonpath", sys.executable]  # otherwise it asks the first python on PATH
    result = run("basedpyright", *flags, *packages, "user_code.py", cwd=user)
    assert result.returncode == 0, result.stdout[-3000:]
    result = run("basedpyright", *flags, "mistakes.py", cwd=user)
    assert wrong_lines(result.stdout) == MISTAKEN, result.stdout


USES = """
import numpy as np
from array import array
from enums_msgs.msg import Old
from enums_msgs.srv import Set
from geometry_msgs.msg import Point
from lyrical_msgs.msg import Former, Words
from numpy.typing import NDArray
from typing_extensions import assert_type


def uses(old: Old) -> None:
    assert_type(old.velocity, float)
    assert_type(old.speeds, "array[float]")
    assert_type(old.three, "NDArray[np.float64]")
    assert_type(old.names, list[str])
    assert_type(old.where, Point)
    assert_type(old.points, list[Point])
    assert_type(old.int, str)
    old.velocity = 1
    old.speeds = range(2)
    old.three = (1, 2, 3)
    old.names = ["a"]
    old.where = Point()
    old.points = []
    old.int = "a"
    Set.Request().kind = 2
    Former().names = ("a", "b")
    assert_type(Former().names, list[str])
    assert_type(Former().count, int)
    assert_type(Former().one, Words)


def others(old: Old) -> Old:
    old.speed = 2
    print(old.point, old.serialize(), Former(names=["a"], one=None).kind)
    return Old(velocity=1, speeds=range(3))
"""


DEPRECATED = set(range(13, 32))


@pytest.mark.long
def test_type_checkers_report_uses_of_deprecated_fields(trees):
    (trees / "uses.py").write_text(USES, encoding="utf-8")
    flags = ["--strict", "--cache-dir", trees / ".mypy", "--enable-error-code", "deprecated"]
    result = run("mypy", *flags, "uses.py", cwd=trees)
    assert "Old._velocity_.__get__ is deprecated: use speed" in result.stdout
    assert wrong_lines(result.stdout, "uses.py") == DEPRECATED, result.stdout
    settings = '{"typeCheckingMode": "standard", "reportDeprecated": "error"}'
    (trees / "pyrightconfig.json").write_text(settings, encoding="utf-8")
    code = ["enums_msgs/msg/_old.py", "enums_msgs/srv/_set.py", "lyrical_msgs/msg/_former.py"]
    result = run("basedpyright", "--pythonpath", sys.executable, "uses.py", *code, cwd=trees)
    assert wrong_lines(result.stdout, "uses.py") == DEPRECATED, result.stdout
    assert "_msgs/" not in result.stdout  # its own code uses none of them
    (trees / "uses.py").unlink()


def wrong_lines(output, name="mistakes.py"):
    """Return the numbers of the lines in a file that a checker complains of."""
    found = (line.split(f"{name}:")[1] for line in output.splitlines() if f"{name}:" in line)
    return {int(line.split(":")[0]) for line in found}
