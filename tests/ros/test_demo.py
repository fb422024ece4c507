"""`make demo` but for its environment: the example, compiled, in the real rclpy."""

import subprocess
import sys
from pathlib import Path

from tests.support.paths import EXAMPLE, ROOT


def test_the_demo(ros_environment, tmp_path):
    wheels = Path(sys.prefix) / "share"
    for source, package in (
        (EXAMPLE, "my_robot_controller"),
        (wheels / "std_msgs", "std_msgs_by_idlc"),
    ):
        words = ["gen", source, "-o", tmp_path / package, "--package", package]
        command = [sys.executable, "-m", "idlc", *map(str, words)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    done = subprocess.run(
        [sys.executable, str(ROOT / "examples" / "demo.py")],
        env=ros_environment | {"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1].startswith("All of it agreed")
