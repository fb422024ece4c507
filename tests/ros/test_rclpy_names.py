"""Fields and messages whose names Python or messages need themselves, on the real rclpy."""

import subprocess
import sys

from tests.runtime import test_citizens
from tests.support import generated
from tests.support.paths import PROGRAMS


def test_names_that_are_taken_are_free_in_ros(tmp_path, ros_environment):
    generated.write_package(tmp_path, "hiding_msgs", test_citizens.HIDING_FILES)
    done = subprocess.run(
        [sys.executable, str(PROGRAMS / "citizens.py")],
        env={**ros_environment, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
