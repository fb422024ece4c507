"""The libraries on the real Fast DDS: type support of messages in serialized form, both ways.

What is in the middle has no class of any message, only the libraries, as a C++ node with generic
publishers and subscriptions.
"""

import json
import sys

import pytest
from installed import HERE, SHARE, interfaces, interfaces_in, names_in
from native import install, model_of
from sides import OURS, PACKAGES, STANDARD, Side
from tools import run

#: How far the second domain is from the first one.
FAR = 100


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    """Return a prefix with the libraries of every package."""
    folder = tmp_path_factory.mktemp("prefix")
    for package in (*(SHARE / one for one in interfaces()), *OURS.values()):
        install(model_of(package), folder)
    return folder


@pytest.fixture
def talk(ros_environment, tmp_path, path_of, prefix, shapes):
    """Let two sides in different domains talk over a bridge; fail on any complaint."""
    sides = []

    def start(domain, path, *command):
        environment = {**ros_environment, "ROS_DOMAIN_ID": str(domain)}
        environment["AMENT_PREFIX_PATH"] = str(prefix)
        sides.append(Side(command, environment, path))

    def run(names, ours, theirs):
        file = tmp_path / "known.json"
        file.write_text(json.dumps({"names": names, "shapes": shapes[0]}), encoding="utf-8")
        one = int(ros_environment["ROS_DOMAIN_ID"])
        peer = (HERE / "peer.py", "messages")
        start(one, path_of(*ours), *peer, "one", "two", file)
        start(one + FAR, path_of(*theirs), *peer, "two", "one", file)
        start(one, str(HERE), HERE / "native_bridge.py", one, one + FAR, file)
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


def test_events_feedback_and_a_hundred_creations(ros_environment, path_of, prefix):
    environment = {**ros_environment, "AMENT_PREFIX_PATH": str(prefix)}
    environment["PYTHONPATH"] = path_of("my_robot_controller")
    said = run(sys.executable, HERE / "native_events.py", FAR, env=environment)
    assert said == "cycles 100\n"
