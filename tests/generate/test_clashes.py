"""Interface names that a generated module could confuse with its own."""

import subprocess
import sys

import pytest

from tests.support import generated

#: Names of helpers in generated modules, of what these import, and of Python's own.
NAMES = [
    "Any",
    "Array",
    "Arrays",
    "Builtins",
    "ClassVar",
    "Codec",
    "Dataclass",
    "Exception",
    "Idlc",
    "Int",
    "Message",
    "Numpy",
    "Object",
    "Self",
    "Service",
    "Struct",
    "Type",
    "Values",
]
FIELDS = "int32[3] fixed [1, 2, 3]\nfloat64[] many\nstring text\n{other} nested\n{other}[2] pair\n"
ROUND_TRIP = """
import sys
sys.path.insert(0, sys.argv[1])
import clashes.action, clashes.msg, clashes.srv
for name in sys.argv[2:]:
    message, service = getattr(clashes.msg, name), getattr(clashes.srv, name)
    for cls in (message, service.Request, getattr(clashes.action, name).Goal):
        value = cls()
        assert list(value.fixed) == [1, 2, 3]
        value.many = [1.5]
        value.nested.value = 7
        again = cls.deserialize(value.serialize())
        assert again == value, (name, again, value)
        assert again.nested.value == 7
    assert type(service.Request().own) is message
"""


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clashes")
    for kind in ("msg", "srv", "action"):
        (folder / "clashes" / kind).mkdir(parents=True)
    (folder / "clashes" / "msg" / "Leaf.msg").write_text("int8 value\n")
    for name in NAMES:
        text = FIELDS.format(other="Leaf")
        (folder / "clashes" / "msg" / f"{name}.msg").write_text(text)
        (folder / "clashes" / "srv" / f"{name}.srv").write_text(f"{text}{name} own\n---\n")
        action = f"{text}{name} own\n---\n---\n"
        (folder / "clashes" / "action" / f"{name}.action").write_text(action)
    command = [sys.executable, "-m", "idlc", "gen", folder / "clashes", "-o", folder / "o/clashes"]
    done = subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return folder / "o"


@pytest.mark.parametrize("name", NAMES)
def test_a_message_and_a_service_of_that_name(package, name):
    command = [sys.executable, "-c", ROUND_TRIP, str(package), name]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-1500:]


def test_fields_whose_paths_read_alike(tmp_path):
    files = {
        "msg/Inner.msg": "string[] b\n",
        "msg/Outer.msg": "string[2] a_b\nInner a\n",
    }
    generated.write_package(tmp_path, "alike_msgs", files)
    with generated.importable(tmp_path):
        message = generated.class_of("alike_msgs/msg/Outer")(a_b=["x", "y"])
        message.a.b = ["z"]
        assert type(message).deserialize(message.serialize()) == message
