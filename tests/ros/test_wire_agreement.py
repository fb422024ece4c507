"""idlc's classes and rosidl's, through the real rclpy, agree on every message of the wheels.

Both have the same names, so each lives in its own process; they exchange files.
"""

import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
SHARE = Path(sys.prefix) / "share"
#: Packages that others refer to: compiled alone, they must work with rosidl's classes inside.
MIXED = ("nav_msgs", "sensor_msgs", "std_srvs", "test_msgs")


def interfaces() -> dict[str, list[tuple[str, str]]]:
    """Return the (kind, name) of each installed interface, by package."""
    found: dict[str, list[tuple[str, str]]] = {}
    for kind in ("msg", "srv", "action"):
        for path in sorted(SHARE.glob(f"*/{kind}/*.{kind}")):
            found.setdefault(path.parts[-3], []).append((kind, path.stem))
    return found


def message_names(package: str, kind: str, name: str) -> list[str]:
    """Return the full names of every message that an interface is or implies."""
    service = ["_Request", "_Response", "_Event"]
    suffixes = {
        "msg": [""],
        "srv": service,
        "action": ["_Goal", "_Result", "_Feedback", "_FeedbackMessage"]
        + [f"_{part}{suffix}" for part in ("SendGoal", "GetResult") for suffix in service],
    }
    return [f"{package}/{kind}/{name}{suffix}" for suffix in suffixes[kind]]


def names_in(*packages: str) -> list[str]:
    found = interfaces()
    return [
        full
        for package in packages
        for kind, name in found[package]
        for full in message_names(package, kind, name)
    ]


def generate(package: str, out: Path) -> None:
    command = [sys.executable, "-m", "idlc", "gen", SHARE / package, "-o", out / package]
    done = subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


@pytest.fixture
def side(ros_environment):
    """Run one side; fail with what it printed unless it looked at everything without complaint."""

    def run(step: str, file: Path, names: list[str], classes: Path | None = None) -> None:
        environment = ros_environment | ({"PYTHONPATH": str(classes)} if classes else {})
        done = subprocess.run(
            [sys.executable, str(HERE / "one_side.py"), step, str(file), *names],
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


def test_every_message_both_ways(side, tmp_path):
    packages = sorted(interfaces())
    names = names_in(*packages)
    assert len(names) > 200
    for package in packages:
        generate(package, tmp_path / "classes")
    record = tmp_path / "record.json"
    side("invent", record, names)
    side("check", record, names, tmp_path / "classes")
    side("read", record, names)


@pytest.mark.parametrize("package", MIXED)
def test_one_package_among_official_ones(package, side, tmp_path):
    generate(package, tmp_path / "classes")
    record = tmp_path / "record.json"
    side("invent", record, names_in(*sorted(interfaces())))
    side("check", record, names_in(package), tmp_path / "classes")
    side("read", record, names_in(package))
