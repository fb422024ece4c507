"""idlc's classes on the real rclpy, between processes, with rosidl's on the other side.

Both have the same names, so each lives in a process of its own; they meet over DDS.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from installed import HERE, SHARE, generate, interfaces, interfaces_in, names_in

STANDARD = ("diagnostic_msgs", "geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs", "std_srvs")
PACKAGES = (*STANDARD, "test_msgs")
#: Packages without rosidl's classes: folder of interface files by name.
OURS = {
    "every_kind": HERE / "every_kind",
    "idlc_fixtures": HERE.parents[1] / "golden" / "rosidl" / "interfaces" / "idlc_fixtures",
    "my_robot_controller": HERE.parents[1] / "examples" / "my_robot_controller",
}


@pytest.fixture(scope="module")
def classes(tmp_path_factory) -> Path:
    """Return a folder with idlc's classes of all packages, each in a folder of its own."""
    folder = tmp_path_factory.mktemp("classes")
    for package in PACKAGES:
        generate(SHARE / package, folder / package / package)
    for package, files in OURS.items():
        generate(files, folder / package / package)
    return folder


@pytest.fixture(scope="module")
def path_of(classes):
    """Return the PYTHONPATH on which `packages` are idlc's."""

    def path(*packages: str) -> str:
        return ":".join([str(HERE), *(str(classes / package) for package in packages)])

    return path


class Side:
    """A peer process; it lives until `finish`."""

    def __init__(self, command, environment, path):
        self.process = subprocess.Popen(
            [sys.executable, str(HERE / "peer.py"), *map(str, command)],
            env={**environment, "PYTHONPATH": path},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def ready(self) -> list[str]:
        """Return the complaints up to the line that says how much was looked at."""
        lines = []
        for line in self.process.stdout:
            lines.append(line.rstrip())
            if line.startswith("looked at"):
                return lines
        return [*lines, f"ended with {self.process.wait()}"]

    def finish(self) -> list[str]:
        """End the process; return what it said since it was ready."""
        rest, _ = self.process.communicate(timeout=60)
        return [*rest.splitlines(), *([] if self.process.returncode == 0 else ["failed"])]


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
            sides.append(Side((step, me, other, file), ros_environment, path_of(*packages)))
        assert [side.ready() for side in sides] == [[f"looked at {len(names)}"]] * 2
        assert [side.finish() for side in reversed(sides)] == [[], []]

    yield run
    for side in sides:
        if side.process.poll() is None:
            side.process.kill()
            side.process.wait()


@pytest.fixture(scope="module")
def shapes(path_of, ros_environment):
    """Return the shape of every message, and the names of messages of idlc's own packages."""
    own_names = names_in(OURS, interfaces_in(OURS.values()))
    names = [*names_in(interfaces(), interfaces()), *own_names]
    done = subprocess.run(
        [sys.executable, str(HERE / "shapes.py"), *names],
        env={**ros_environment, "PYTHONPATH": path_of(*OURS)},
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(done.stdout), own_names


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
