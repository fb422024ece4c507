"""Processes that talk to one another over DDS, and the packages that they know."""

import subprocess
import sys

from tests.support.paths import EVERY_KIND, EXAMPLE, GOLDEN
from tests.support.waiting import LIMIT, WORK, read_line

STANDARD = ("diagnostic_msgs", "geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs", "std_srvs")
PACKAGES = (*STANDARD, "test_msgs")
#: Packages without rosidl's classes: folder of interface files by name.
OURS = {
    "every_kind": EVERY_KIND,
    "idlc_fixtures": GOLDEN / "rosidl" / "interfaces" / "idlc_fixtures",
    "my_robot_controller": EXAMPLE,
}


class Side:
    """A peer process; it lives until `finish`."""

    def __init__(self, command, environment, path):
        self.process = subprocess.Popen(
            [sys.executable, *map(str, command)],
            env={**environment, "PYTHONPATH": path},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def ready(self) -> list[str]:
        """Return the complaints up to the line that says how much was looked at."""
        lines = []
        while line := read_line(self.process.stdout, WORK):
            lines.append(line.rstrip())
            if line.startswith("looked at"):
                return lines
        return [*lines, f"ended with {self.process.wait(LIMIT)}"]

    def finish(self) -> list[str]:
        """End the process; return what it said since it was ready."""
        rest, _ = self.process.communicate()
        return [*rest.splitlines(), *([] if self.process.returncode == 0 else ["failed"])]
