"""`idlc breaking --against graph` with nodes that run, of idlc's classes and of rosidl's."""

import json
import re
import subprocess
import sys

import pytest

from tests.support import generated
from tests.support.paths import PROGRAMS
from tests.support.waiting import read_line

#: Versions of one package.
FILES = {
    "msg/Drive.msg": "std_msgs/Header header\nfloat64 speed\nPart[<=3] parts\n",
    "msg/Part.msg": "uint8 RED=1\nstring<=5 name\nwstring[2] labels\n",
    "srv/Go.srv": "float64 to\n---\nbool done\n",
    "action/Fly.action": "float64 to\n---\nbool done\n---\nfloat64 left\n",
}
VERSIONS = {
    "one": FILES,
    "two": {
        **FILES,
        "msg/Part.msg": "uint8 RED=2\nstring<=5 name\nwstring[2] labels\nbyte colour\n",
        "srv/Go.srv": "float32 to\n---\nbool done\n",
        "action/Fly.action": "float64 to\n---\nbool done\n---\nfloat32 left\n",
    },
    "three": {**FILES, "msg/Drive.msg": "float64 pace\n"},
    "four": {**FILES, "msg/Drive.msg": "int8 x\n"},
}
#: How often idlc looks for nodes that it does not see yet.
ATTEMPTS = 10
DRIVE = "demo_msgs/msg/Drive:/robot/drive"
GO = "demo_msgs/srv/Go:/robot/go"
FLY = "demo_msgs/action/Fly:/robot/fly"


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    """Return a folder with the versions of a package, each in a folder of its own."""
    folder = tmp_path_factory.mktemp("versions")
    for version, files in VERSIONS.items():
        generated.write_package(folder / version, "demo_msgs", files)
        for path, text in files.items():
            file = folder / "sources" / version / "demo_msgs" / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
    return folder


@pytest.fixture
def nodes():
    """Yield the processes of nodes; all are ended at the end."""
    started = []
    yield started
    for process in started:
        process.kill()
        process.communicate()


@pytest.fixture
def start(lonely_environment, packages, nodes):
    """Start a node with a version of the package."""

    def run(version, name, *words):
        nodes.append(
            subprocess.Popen(
                [sys.executable, str(PROGRAMS / "graph_node.py"), name, *words],
                env={**lonely_environment, "PYTHONPATH": str(packages / version)},
                stdout=subprocess.PIPE,
                text=True,
            )
        )

    return run


@pytest.fixture
def look(lonely_environment, tmp_path, nodes):
    """Return status and output of idlc, once it sees all nodes that were started."""

    ready = []

    def run(*words, patience="1"):
        command = [sys.executable, "-m", "idlc", "breaking", "--against", "graph"]
        for process in nodes:
            if process not in ready:
                assert read_line(process.stdout) == "ready\n"
                ready.append(process)
        for _ in range(ATTEMPTS):
            done = subprocess.run(
                [*command, *map(str, words), "--timeout", patience],
                env=lonely_environment,
                cwd=tmp_path,
                capture_output=True,
                text=True,
                check=False,
            )
            assert "Traceback" not in done.stderr
            seen = re.search(r'compared (\d+) node|"node": (\d+)[,}]', done.stdout)
            if not nodes or (seen and int(seen[1] or seen[2]) == len(nodes)):
                break
        return done.returncode, done.stdout

    return run


def findings(said):
    """Return the JSON lines of each type."""
    found = {"diagnostic": [], "endpoint": [], "summary": []}
    for line in map(json.loads, said.splitlines()):
        found[line["type"]].append(line)
    return found


def test_two_versions_are_told_field_by_field(start, look, packages):
    start("one", "talker", f"publisher:{DRIVE}", f"server:{GO}", f"server:{FLY}", "events")
    start("two", "listener", f"subscription:{DRIVE}", f"client:{GO}", f"client:{FLY}", "events")
    status, said = look()
    assert status == 1
    for expected in (
        "`demo_msgs/msg/Drive` has 2 versions: in",
        "`/talker` publishes on topic `/robot/drive`",
        "the differences are in `demo_msgs/msg/Part`",
        "field `colour` was added (`/talker` → `/listener`)",
        "constant `RED` changed from 1 to 2 (`/talker` → `/listener`)",
        "`demo_msgs/srv/Go_Request` has 2 versions",
        "field `to` changed from `float32` to `float64` (`/listener` → `/talker`)",
        "`demo_msgs/action/Fly_FeedbackMessage` has 2 versions",
        "field `left` changed from `float64` to `float32` (`/talker` → `/listener`)",
        "`/talker` serves action `/robot/fly`",
    ):
        assert expected in said
    assert said.count("field `colour`") == 1
    assert "only its hash" not in said
    # the same with the files of one of them, which then need not be asked for
    status, said = look(packages / "sources/two/demo_msgs", "--format", "json")
    found = findings(said)
    assert status == 1
    added = next(one for one in found["diagnostic"] if one["code"] == "IDL505")
    assert added["path"].endswith("sources/two/demo_msgs/msg/Part.msg")
    assert (added["line"], added["levels"]) == (4, ["wire", "hash"])
    goals = [one for one in found["endpoint"] if one["structure"].endswith("SendGoal_Request")]
    assert {(one["node"], one["role"], one["name"]) for one in goals} == {
        ("/talker", "server", "/robot/fly"),
        ("/listener", "client", "/robot/fly"),
    }
    assert len({one["hash"] for one in goals}) == 1


@pytest.mark.long
def test_who_does_not_answer_is_known_by_hash(start, look):
    """A node that dies meanwhile, one that is always busy, and one that describes nothing."""
    start("one", "talker", f"publisher:{DRIVE}", f"server:{GO}")
    start("two", "dead", f"subscription:{DRIVE}", "dying")
    start("three", "still", f"publisher:{DRIVE}", f"client:{GO}", "busy")
    start("four", "mute", f"subscription:{DRIVE}", "mute")
    status, said = look(patience="4")
    assert status == 1
    assert "`demo_msgs/msg/Drive` has 4 versions" in said
    assert "idlc has only its hash: `/dead` does not reply" in said
    assert "idlc has only its hash: `/still` does not reply" in said
    assert "idlc has only its hash: `/mute` has no ~/get_type_description" in said
    assert "Go_Request" not in said


def test_a_service_without_events_is_told_by_files(start, look, packages):
    start("one", "server", f"server:{GO}")
    status, said = look(packages / "sources/two/demo_msgs", patience="4")
    assert status == 1
    assert "service introspection" in said
    status, said = look(
        packages / "sources/two/demo_msgs", "-I", packages / "sources/one", patience="4"
    )
    assert status == 1
    assert "field `to` changed from `float32` to `float64` (your files → `/server`)" in said


def test_nodes_that_agree_are_no_finding(start, look, packages):
    """rosidl's classes and idlc's; those of the wheels are what is installed here."""
    start("one", "talker", f"publisher:{DRIVE}", "publisher:std_msgs/msg/String:/chat")
    words = ("server:std_srvs/srv/SetBool:/set", "server:test_msgs/action/Fibonacci:/count")
    start("one", "listener", "subscription:std_msgs/msg/String:/chat", *words)
    start("one", "_hidden", f"subscription:{DRIVE}", "publisher:std_msgs/msg/Empty:/_hidden")
    status, said = look("--format", "json")
    found = findings(said)
    assert (status, found["diagnostic"]) == (0, [])
    assert {one["name"] for one in found["endpoint"]} >= {"/chat", "/_hidden", "/set", "/count"}
    assert {one["node"] for one in found["endpoint"]} == {"/talker", "/listener", "/_hidden"}
    assert found["summary"][0]["silent"] == 0
    assert look(packages / "sources/one/demo_msgs")[0] == 0


def test_two_types_on_one_topic(start, look):
    start("one", "talker", "publisher:std_msgs/msg/String:/chat")
    start("one", "other", "subscription:std_msgs/msg/Empty:/chat")
    status, said = look()
    assert status == 1
    assert "error[IDL531]: topic `/chat` has endpoints with 2 types" in said


def test_nobody_is_there(look):
    status, said = look()
    assert status == 2
    assert "error[IDL641]" in said


def test_rclpy_that_cannot_start(look, lonely_environment):
    lonely_environment["ROS_LOG_DIR"] = "/dev/null/nowhere"
    status, said = look()
    assert status == 2
    assert "error[IDL640]: rclpy cannot start a node: " in said
