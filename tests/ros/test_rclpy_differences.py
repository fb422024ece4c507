"""docs/robot-nodes.md lists what idlc.robot lacks of the installed rclpy."""

import os
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version

import pytest

from tests.support.paths import ROOT

PAGE = ROOT / "docs/robot-nodes.md"
HEADING = "## Missing names and arguments\n"


def test_the_list_of_missing_names_is_complete(ros_environment):
    try:
        installed = version("ros-jazzy-rclpy")
    except PackageNotFoundError:
        installed = ""
    page = PAGE.read_text(encoding="utf-8")
    before, _, section = page.partition(HEADING)
    intro, _, listed = section.strip("\n").partition("\n\n")
    if installed not in intro or not installed:
        pytest.skip("the page compares with another version of rclpy")
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-m", "maintenance.rclpy_differences"],
        cwd=ROOT,
        env=ros_environment,
        capture_output=True,
        encoding="utf-8",
        check=True,
    )
    if os.environ.get("IDLC_REFRESH"):
        PAGE.write_text(f"{before}{HEADING}\n{intro}\n\n{done.stdout}", encoding="utf-8")
    assert listed == done.stdout.strip("\n")
