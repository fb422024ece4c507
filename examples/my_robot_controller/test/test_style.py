"""The package keeps the style of ROS 2's own packages, where its checkers are installed."""

from pathlib import Path
import subprocess
import sys

import pytest

PACKAGE = Path(__file__).parents[1]
FILES = [
    str(path)
    for folder in ('my_robot_controller', 'launch', 'test')
    for path in sorted((PACKAGE / folder).glob('*.py'))
]


@pytest.mark.flake8
@pytest.mark.linter
def test_flake8() -> None:
    """ament_flake8 reports no problems."""
    pytest.importorskip('ament_flake8.main')
    # in a process of its own: flake8 forks, which rclpy's threads do not survive
    program = 'import sys; from ament_flake8.main import main; sys.exit(main(sys.argv[1:]))'
    done = subprocess.run(
        [sys.executable, '-c', program, *FILES], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.linter
@pytest.mark.pep257
def test_pep257() -> None:
    """ament_pep257 reports no problems."""
    pep257 = pytest.importorskip('ament_pep257.main')
    assert pep257.main(argv=FILES) == 0
