"""idlc's classes and rosidl's, through the real rclpy, agree on every message of the wheels.

Both have the same names, so each lives in its own process; they exchange files.
"""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.installed import SHARE, generate, interfaces, names_in
from tests.support.paths import PROGRAMS

#: Packages that others refer to: compiled alone, they must work with rosidl's classes inside.
MIXED = ("nav_msgs", "sensor_msgs", "std_srvs", "test_msgs")


@pytest.fixture(scope="module")
def side(ros_environment):
    """Run one side; fail with what it printed unless it looked at everything without complaint."""

    def run(step: str, file: Path, names: list[str], classes: Path | None = None) -> None:
        environment = ros_environment | ({"PYTHONPATH": str(classes)} if classes else {})
        done = subprocess.run(
            [sys.executable, str(PROGRAMS / "one_side.py"), step, str(file), *names],
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        *complaints, last = done.stdout.splitlines()
        assert complaints[:20] == []
        assert last == f"looked at {len(names)}"

    return run


@pytest.fixture(scope="module")
def invented(side, tmp_path_factory):
    """Return a file with values of all messages, and what rosidl makes of them."""
    record = tmp_path_factory.mktemp("invented") / "record.json"
    side("invent", record, names_in(interfaces(), interfaces()))
    return record


@pytest.fixture
def record(invented, tmp_path):
    """Return a copy of the values, to which one test adds idlc's bytes."""
    return Path(shutil.copy(invented, tmp_path))


def test_every_message_both_ways(side, record, tmp_path):
    found = interfaces()
    packages = sorted(found)
    names = names_in(packages, found)
    assert len(names) > 200
    for package in packages:
        generate(SHARE / package, tmp_path / "classes" / package)
    side("check", record, names, tmp_path / "classes")
    side("read", record, names)


@pytest.mark.parametrize("package", MIXED)
def test_one_package_among_official_ones(package, side, record, tmp_path):
    generate(SHARE / package, tmp_path / "classes" / package)
    side("check", record, names_in([package], interfaces()), tmp_path / "classes")
    side("read", record, names_in([package], interfaces()))
