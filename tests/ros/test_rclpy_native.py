"""The libraries on the real Fast DDS: type support of messages in serialized form, both ways.

What is in the middle has no class of any message, only the libraries, as a C++ node with generic
publishers and subscriptions.
"""

import json
import sys

import pytest

from tests.support.installed import SHARE, interfaces, interfaces_in, names_in
from tests.support.native import FAR, both_ways, install, model_of
from tests.support.paths import PROGRAMS
from tests.support.sides import OURS, PACKAGES, STANDARD, Side
from tests.support.tools import run
from tests.support.waiting import LIMIT

#: What services and actions tell of themselves: end of the topic, of the type, and how.
EVENTS = ("_service_event", "Event", "kept")
FEEDBACK = ("_action/feedback", "FeedbackMessage", "passing")


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    """Return a prefix with the libraries of every package."""
    folder = tmp_path_factory.mktemp("prefix")
    for package in (*(SHARE / one for one in interfaces()), *OURS.values()):
        install(model_of(package), folder)
    return folder


@pytest.fixture
def environment(ros_environment, prefix):
    """Return an environment in which nothing but the libraries is found."""
    return {**ros_environment, "AMENT_PREFIX_PATH": str(prefix)}


@pytest.fixture
def talk(environment, tmp_path, path_of, shapes):
    """Let two sides talk over a bridge; fail on any complaint."""
    sides = []
    environment["FASTDDS_DEFAULT_PROFILES_FILE"] = str(PROGRAMS / "no_type_lookup.xml")

    def start(packages, *command):
        sides.append(Side(command, environment, path_of(*packages)))

    def run(names, topics, one, two):
        """Start each side with the packages of idlc's that it knows, and the rest of its words."""
        file = tmp_path / "known.json"
        known = {"names": names, "shapes": shapes[0], "topics": topics}
        file.write_text(json.dumps(known), encoding="utf-8")
        for (step, packages, *words), me, other in ((one, "one", "two"), (two, "two", "one")):
            start(packages, PROGRAMS / "peer.py", step, me, other, file, *words)
        start((), PROGRAMS / "native_bridge.py", file)
        assert [side.ready() for side in sides] == [[f"looked at {len(names)}"]] * 3
        assert [side.finish() for side in reversed(sides)] == [[], [], []]

    yield run
    for side in sides:
        if side.process.poll() is None:
            side.process.kill()
            side.process.wait(LIMIT)


def remapped(*rules):
    return ["--ros-args", *(word for rule in rules for word in ("--remap", rule))]


def exchange(talk, names, near, far):
    """Let what a side publishes reach the other, which is in another namespace."""
    words = remapped(f"__ns:={FAR}")
    talk(names, both_ways(names), ("messages", near), ("messages", far, *words))


def test_every_message_between_idlc_and_rosidl(talk):
    """They arrive both ways, with the same type names and hashes in the graph."""
    every = interfaces()
    exchange(talk, names_in(every, every), every, ())


def test_every_message_of_own_packages(talk):
    found = interfaces_in(OURS.values())
    exchange(talk, names_in(found, found), OURS, (*OURS, *STANDARD))


def overhear(talk, found, server, caller):
    """Let all that the caller hears of the server's events and feedback come over the bridge."""
    names = [
        f"{package}/{kind}/{name}"
        for package in found
        for kind, name in found[package]
        if kind != "msg"
    ]
    topics = []
    for name in names:
        end, part, how = EVENTS if "/srv/" in name else FEEDBACK
        source = f"/one/{name}/{end}"
        topics.append((f"{name}_{part}", source, FAR + source, how))
    rules = remapped(*(f"{source}:={target}" for _, source, target, _ in topics))
    talk(names, topics, ("serve", server), ("call", caller, *rules))


@pytest.mark.parametrize("sides", [(PACKAGES, ()), ((), PACKAGES)], ids=["idlc", "rosidl"])
def test_events_and_feedback_between_idlc_and_rosidl(talk, sides):
    packages = ("nav_msgs", "std_srvs", "test_msgs")
    overhear(talk, {one: interfaces()[one] for one in packages}, *sides)


def test_events_and_feedback_of_own_packages(talk):
    overhear(talk, interfaces_in(OURS.values()), OURS, (*OURS, *STANDARD))


def test_a_hundred_creations(environment, path_of):
    """The library is opened in each way, closed, and opened again; Fast DDS is as it comes."""
    environment["PYTHONPATH"] = path_of("my_robot_controller")
    assert run(sys.executable, PROGRAMS / "native_cycles.py", env=environment) == "cycles 100\n"
