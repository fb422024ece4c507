"""The libraries on the real Fast DDS: type support of messages in serialized form, both ways.

What is in the middle has no class of any message, only the libraries, as a C++ node with generic
publishers and subscriptions.
"""

import json
import sys

import pytest

from tests.support.installed import SHARE, interfaces, interfaces_in, names_in
from tests.support.native import install, model_of
from tests.support.paths import PROGRAMS
from tests.support.sides import OURS, PACKAGES, STANDARD, Side
from tests.support.tools import run

#: The namespace of the second side.
FAR = "/far"


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    """Return a prefix with the libraries of every package."""
    folder = tmp_path_factory.mktemp("prefix")
    for package in (*(SHARE / one for one in interfaces()), *OURS.values()):
        install(model_of(package), folder)
    return folder


@pytest.fixture
def environment(ros_environment, prefix):
    """Return an environment in which the libraries are found, and endpoints for certain."""
    profiles = {"FASTDDS_DEFAULT_PROFILES_FILE": str(PROGRAMS / "no_type_lookup.xml")}
    return {**ros_environment, **profiles, "AMENT_PREFIX_PATH": str(prefix)}


@pytest.fixture
def talk(environment, tmp_path, path_of, shapes):
    """Let two sides in different namespaces talk over a bridge; fail on any complaint."""
    sides = []

    def start(path, *command):
        sides.append(Side(command, environment, path))

    def run(names, ours, theirs):
        file = tmp_path / "known.json"
        file.write_text(json.dumps({"names": names, "shapes": shapes[0]}), encoding="utf-8")
        peer = (PROGRAMS / "peer.py", "messages")
        far = ("--ros-args", "--remap", f"__ns:={FAR}")
        start(path_of(*ours), *peer, "one", "two", file)
        start(path_of(*theirs), *peer, "two", "one", file, *far)
        start(str(PROGRAMS), PROGRAMS / "native_bridge.py", FAR, file)
        assert [side.ready() for side in sides] == [[f"looked at {len(names)}"]] * 3
        assert [side.finish() for side in reversed(sides)] == [[], [], []]

    yield run
    for side in sides:
        if side.process.poll() is None:
            side.process.kill()
            side.process.wait()


def test_every_message_between_idlc_and_rosidl(talk):
    """They arrive both ways, with the same type names and hashes in the graph."""
    talk(names_in(PACKAGES, interfaces()), PACKAGES, ())


def test_every_message_of_own_packages(talk):
    found = interfaces_in(OURS.values())
    talk(names_in(OURS, found), OURS, (*OURS, *STANDARD))


def test_events_feedback_and_a_hundred_creations(environment, path_of):
    environment["PYTHONPATH"] = path_of("my_robot_controller")
    said = run(sys.executable, PROGRAMS / "native_events.py", FAR, env=environment)
    assert said == "cycles 100\n"
