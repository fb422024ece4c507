"""idlc's classes on the real rclpy, between processes, with rosidl's on the other side.

Both have the same names, so each lives in a process of its own; they meet over DDS.
"""

import json

import pytest

from tests.support.installed import interfaces, interfaces_in, names_in
from tests.support.paths import PROGRAMS
from tests.support.sides import OURS, PACKAGES, STANDARD, Side
from tests.support.waiting import LIMIT

PEER = PROGRAMS / "peer.py"


@pytest.fixture
def talk(ros_environment, tmp_path, path_of):
    """Let two sides talk; fail on any complaint."""
    sides = []

    def run(names, shapes, steps, ours, theirs):
        file = tmp_path / "known.json"
        file.write_text(json.dumps({"names": names, "shapes": shapes}), encoding="utf-8")
        for step, me, other, packages in zip(
            steps, ("one", "two"), ("two", "one"), (ours, theirs), strict=True
        ):
            sides.append(Side((PEER, step, me, other, file), ros_environment, path_of(*packages)))
        assert [side.ready() for side in sides] == [[f"looked at {len(names)}"]] * 2
        assert [side.finish() for side in reversed(sides)] == [[], []]

    yield run
    for side in sides:
        if side.process.poll() is None:
            side.process.kill()
            side.process.wait(LIMIT)


@pytest.mark.parametrize("packages", [PACKAGES, ("nav_msgs", "test_msgs")], ids=["all", "mixed"])
def test_messages_both_ways_with_rosidl(packages, talk, shapes):
    """Every message arrives, with the same type name and hash in the graph."""
    names = names_in(packages, interfaces())
    talk(names, shapes[0], ("messages", "messages"), packages, ())


def test_messages_of_own_packages(talk, shapes):
    every, own_names = shapes
    talk(own_names, every, ("messages", "messages"), OURS, (*OURS, *STANDARD))


def entities(packages, found):
    """Return the full names of services and actions."""
    return [
        f"{package}/{kind}/{name}"
        for package in packages
        for kind, name in found[package]
        if kind != "msg"
    ]


@pytest.mark.parametrize("direction", ["idlc serves", "rosidl serves"])
def test_services_and_actions_with_rosidl(direction, talk, shapes):
    names = entities(("nav_msgs", "std_srvs", "test_msgs"), interfaces())
    sides = [PACKAGES, ()]
    if direction == "rosidl serves":
        sides.reverse()
    talk(names, shapes[0], ("serve", "call"), *sides)


def test_services_and_actions_of_own_packages(talk, shapes):
    names = entities(OURS, interfaces_in(OURS.values()))
    talk(names, shapes[0], ("serve", "call"), OURS, (*OURS, *STANDARD))
