"""A scaffolded translator between nodes of two versions, on the real rclpy."""

import sys

import pytest

from idlc.cli.main import main
from tests.support import programs
from tests.support.files import write
from tests.support.nodes import nodes
from tests.support.waiting import read_line

WHEEL = "float32 radius\nstring name\n"
OLD = {
    "msg/Drive.msg": "int16 speed\nuint8[] raw\nfloat32[2] pair\nWheel[] wheels\n",
    "msg/Wheel.msg": WHEEL,
    "srv/Ask.srv": "string name\n---\nint8 count\nstring why\n",
}
NEW = {
    "msg/Drive.msg": "int8 gear 3\nfloat64[] pair\nint32 speed\nuint8[] raw\nWheel[] wheels\n",
    "msg/Wheel.msg": WHEEL.replace("float32", "float64"),
    "srv/Ask.srv": "string name\nbool loud\n---\nstring why\nint8 count\n",
}
WORDS = "scaffold node translator --translate ../old/my_msgs ../new/my_msgs".split()
TOPICS = "--topic my_msgs/Drive:drive:drive_v2 --topic my_msgs/Ask:ask:ask_v2".split()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with both versions, generated and not, and a package with the node."""
    folder = tmp_path_factory.mktemp("versions")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for version, texts in {"old": OLD, "new": NEW}.items():
            for path, text in texts.items():
                write(folder / version / "my_msgs" / path, text)
            assert main(["gen", f"{version}/my_msgs", "-o", f"path/{version}/my_msgs"]) == 0
        assert main(["scaffold", "package", "demo"]) == 0
        patch.chdir(folder / "demo")
        assert main([*WORDS, *TOPICS]) == 0
    return folder


def test_nodes_of_both_versions_understand_each_other(folder, ros_environment, program, tmp_path):
    # the package of the new version is there, too, and is not mistaken for the old one
    environment = {**ros_environment, "PYTHONPATH": str(folder / "path/new")}
    new = program("versions_side.py", "new", path=folder / "path/new")
    assert read_line(new.stdout) == "ready\n", new.communicate()
    with nodes(folder / "demo", tmp_path, environment) as start:
        translator = start("demo.translator")
        old = program("versions_side.py", "old", path=folder / "path/old")
        out, complaints = old.communicate()
        assert old.returncode == 0, (complaints, translator.output)
        new.kill()  # rclpy can miss SIGTERM just before it waits
        received, _ = new.communicate()
        assert "Traceback" not in translator.output, translator.output
    assert out.splitlines() == [
        "response: {'count': 1, 'why': 'Ada!'}",
        "my_msgs/msg/Drive True",
        "my_msgs/msg/Drive False",
    ]
    assert received.splitlines()[0] == (
        "message: {'gear': 3, 'pair': [0.5, 2.5], 'speed': -3, 'raw': [1, 2], "
        "'wheels': [{'radius': 0.25, 'name': 'left'}]}"
    )


@pytest.mark.parametrize(
    "words",
    [
        pytest.param(["mypy"], marks=pytest.mark.jazzy),
        ["pytest", "-q", "-p", "no:cacheprovider", "test"],
    ],
    ids=["mypy", "pytest"],
)
@pytest.mark.long
def test_it_is_typed_and_passes_its_own_tests(folder, words, ros_environment):
    programs.run(sys.executable, "-m", *words, cwd=folder / "demo", environment=ros_environment)


def test_it_refuses_one_topic_for_both_versions(folder, ros_environment):
    """Also if a remapping makes the names equal."""
    command = [sys.executable, "-m", "demo.translator", "--ros-args", "-r", "drive_v2:=drive"]
    status, said = programs.ended(*command, cwd=folder / "demo", environment=ros_environment)
    assert status == 1
    assert "drive: both versions have the same topic" in said
