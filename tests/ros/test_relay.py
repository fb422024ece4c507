"""The relay of docs/change-a-message.md between nodes of two versions, on the real rclpy."""

import re

import pytest

from idlc.cli.main import main
from tests.end_to_end.test_change_a_message import TEXT, follow
from tests.support.nodes import nodes
from tests.support.waiting import read_line

SPIN = "rclpy.spin(node)\n"
SERVICES = [
    {"my_msgs/srv/Ask.srv": "string name\n---\nint8 count\nstring why\n"},
    {"my_msgs/srv/Ask.srv": "string name\nbool loud\n---\nstring why\nint8 count\n"},
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with the two versions of the page, generated and not, and its relay."""
    folder = tmp_path_factory.mktemp("versions")
    with pytest.MonkeyPatch.context() as patch:
        follow(folder / "work", patch, SERVICES)
        patch.chdir(folder)
        for version, package in {"old": "v1/my_msgs", "new": "work/my_msgs"}.items():
            assert main(["gen", package, "-o", f"path/{version}/my_msgs"]) == 0
    files = dict(re.findall(r"```\w+ (relay\.py|fast_dds\.xml)\n(.*?)```", TEXT, re.DOTALL))
    (service,) = re.findall(r"```python\n(from rclpy.*?)```", TEXT, re.DOTALL)
    assert files["relay.py"].endswith(SPIN)
    files["relay.py"] = files["relay.py"].replace(SPIN, service + SPIN)
    for name, text in files.items():
        (folder / "work" / name).write_text(text, encoding="utf-8")
    return folder


def test_nodes_of_both_versions_understand_each_other(folder, ros_environment, program, tmp_path):
    # the package of the new version is there, too, and is not mistaken for the old one
    environment = {
        **ros_environment,
        "PYTHONPATH": str(folder / "path/new"),
        "FASTDDS_DEFAULT_PROFILES_FILE": "fast_dds.xml",
    }
    new = program("versions_side.py", "new", path=folder / "path/new")
    assert read_line(new.stdout) == "ready\n", new.communicate()
    with nodes(folder / "work", tmp_path, environment) as start:
        relay = start("relay")
        old = program("versions_side.py", "old", path=folder / "path/old")
        out, complaints = old.communicate()
        assert old.returncode == 0, (complaints, relay.output)
        new.kill()  # rclpy can miss SIGTERM just before it waits
        received, _ = new.communicate()
        assert "Traceback" not in relay.output, relay.output
    assert out.splitlines() == [
        "response: {'count': 1, 'why': 'Ada!'}",
        "my_msgs/msg/Drive True",
        "my_msgs/msg/Drive False",
    ]
    assert received.splitlines()[0] == "message: 3 3.141593 1"
