"""A generated package stands alone: without idlc, without numpy, without what it does not use."""

import ast
import json
import subprocess
import sys

import pytest

from idlc.generate.python.render import render_package
from tests.support import generated
from tests.support.paths import ROOT

PLAIN = {
    "msg/Plain.msg": "float64 x\nint32[] numbers\nstring[] names\nInner inner\n",
    "msg/Inner.msg": "bool[3] flags\nwstring wide\n",
    "msg/Fixed.msg": "float64[3] values\n",
    "srv/Ask.srv": "string what\n---\nint32[] found\n",
    "action/Move.action": "float32 to\n---\nbool ok\n---\nfloat32 at\n",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("alone")
    generated.write_package(folder, "plain_msgs", PLAIN)
    return folder


def run(folder, code):
    """Run code in an interpreter that has the standard library and one folder."""
    return subprocess.run(
        [
            sys.executable,
            "-I",
            "-S",
            "-c",
            f"import sys; sys.path.insert(0, {str(folder)!r})\n{code}",
        ],
        capture_output=True,
        text=True,
        check=False,
    )


def test_it_works_without_any_other_package(folder):
    result = run(
        folder,
        """
from plain_msgs.msg import Plain, Inner
from plain_msgs.srv import Ask
from plain_msgs.action import Move
import copy, dataclasses, json, pickle
message = Plain(1.5, [1, 2], ["a"], Inner([True, False, True], "w"))
for order in ("little", "big"):
    assert Plain.deserialize(message.serialize(byteorder=order)) == message
assert Plain.from_dict(json.loads(json.dumps(message.to_dict()))) == message
message.validate()
assert dataclasses.replace(message, x=2.0).x == 2.0
assert pickle.loads(pickle.dumps(message)) == copy.deepcopy(message) == message
assert Ask.Request.deserialize(Ask.Request("x").serialize()).what == "x"
assert Move.Goal.deserialize(Move.Goal(0.5).serialize()).to == 0.5
try:
    Plain.deserialize(b"")
except ValueError as error:
    print(error)
print(*sorted(set(sys.modules) & {"numpy", "idlc", "lark", "jinja2", "msgspec", "rclpy"}))
""",
    )
    assert result.stderr == ""
    assert result.stdout == "the encapsulation header needs 4 bytes, there are 0 at byte 0\n\n"


def test_numpy_is_asked_for_only_by_who_needs_it(folder):
    result = run(folder, "from plain_msgs.msg import Fixed")
    assert "No module named 'numpy'" in result.stderr


def test_importing_one_message_imports_little(folder):
    result = run(
        folder,
        "before = set(sys.modules)\nfrom plain_msgs.msg import Plain\nPlain().serialize()\n"
        "import json; print(json.dumps(sorted(set(sys.modules) - before)))",
    )
    loaded = set(json.loads(result.stdout))
    assert not loaded & {"dataclasses", "inspect", "ctypes", "plain_msgs.srv", "numpy"}
    assert "plain_msgs.msg._fixed" not in loaded
    assert "plain_msgs._idlc.typesupport" not in loaded
    assert "plain_msgs._idlc.typeinfo" not in loaded


def test_the_support_package_imports_nothing_of_idlc():
    allowed = sys.stdlib_module_names | {"numpy", "pyarrow", "rclpy", "typing_extensions"}
    # type checkers look these up, as parts of what ROS 2 adds
    allowed |= {"builtin_interfaces", "service_msgs", "unique_identifier_msgs"}
    for path in sorted((ROOT / "idlc" / "runtime").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found = {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                found = {(node.module or "").partition(".")[0]}
            else:
                continue
            assert found <= allowed, path.name


def test_a_package_does_not_become_heavier():
    """Everybody who generates a package commits this, and reviews it."""
    modules = list((ROOT / "idlc" / "runtime").rglob("*.py"))
    assert {path.parent.name for path in modules} == {"runtime"}
    assert len(modules) <= 16
    text = "".join(path.read_text(encoding="utf-8") for path in modules)
    assert text.count("\n") <= 5263
    assert len(text.encode()) <= 200_000
    example = ROOT / "examples/my_robot_controller/my_robot_controller/_idlc"
    assert (
        len([path for path in example.rglob("*") if path.suffix != ".pyc" and path.is_file()]) <= 17
    )


def test_columns_need_idlc_and_one_sentence_says_so(folder):
    """In a fresh environment, as on a robot."""
    result = run(
        folder,
        """
from plain_msgs.msg import Plain
for read in (Plain.to_columns, Plain.to_arrow):
    try:
        read([Plain().serialize()])
    except ImportError as error:
        print(error.name, error)
""",
    )
    assert result.stderr == ""
    sentence = (
        "idlc columns are read by idlc, which cannot be imported (No module named 'idlc'): "
        "pip install --upgrade 'idlc[recordings]'\n"
    )
    assert result.stdout == 2 * sentence


def test_it_may_be_part_of_another_package(folder, tmp_path):
    generated.write_package(tmp_path / "robot", "plain_msgs", PLAIN)
    result = run(
        tmp_path,
        "from robot.plain_msgs.msg import Plain\nm = Plain(inner=None)\nm.validate()\n"
        "print(Plain.from_dict({'inner': {'wide': 'x'}}).inner.wide)",
    )
    assert (result.stdout, result.stderr) == ("x\n", "")


def test_no_build_can_leave_out_what_it_needs():
    """A setup.py without `package_data` installs modules, and py.typed is for checkers only."""
    files = render_package(generated.model_of("plain_msgs", PLAIN))
    assert {file.path for file in files if not file.path.endswith(".py")} == {"py.typed"}
