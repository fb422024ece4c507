"""What the README shows is what happens."""

import re
import shutil
import subprocess
import sys
from itertools import takewhile
from pathlib import Path

from tests.support.paths import EXAMPLE, ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")


def run(*words: object, cwd: Path) -> subprocess.CompletedProcess:
    command = [sys.executable, *map(str, words)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)


def shell(script: str, cwd: Path) -> None:
    idlc = f"idlc() {{ '{sys.executable}' -m idlc \"$@\"; }}\n"
    done = subprocess.run(
        ["/bin/sh", "-e", "-c", idlc + script], cwd=cwd, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_the_first_result_comes_soon(tmp_path):
    """As pasted into an empty folder: the commands after the installation, then the code."""
    lines = README.splitlines()
    first = next(n for n, line in enumerate(lines) if line.startswith("    pip install"))
    commands = list(takewhile(lambda line: line.startswith("    "), lines[first + 1 :]))
    shell("\n".join(commands), tmp_path)
    codes = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    assert len(codes) == 2
    done = run("-c", "".join(codes), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert README[: README.index(codes[0]) + len(codes[0])].count("\n") < 25


def test_what_the_classes_are_said_to_offer(tmp_path):
    shutil.copytree(EXAMPLE, tmp_path / "interfaces")
    shell("idlc gen interfaces -o my_robot_controller", tmp_path)
    (names,) = re.findall(r"API of rosidl's: (.*?)\.\n", README, re.DOTALL)
    shown = re.findall(r"`([\w.]+)(?:\(\))?`", names)
    assert len(shown) >= 4
    code = "\n".join(
        [
            "from my_robot_controller.msg import RobotCommand",
            "from my_robot_controller.srv import AddTwoInts",
            "from my_robot_controller.action import Countdown",
            *(name if "." in name else f"RobotCommand.{name}" for name in shown),
        ]
    )
    done = run("-c", code, cwd=tmp_path)
    assert done.returncode == 0, done.stderr


def test_the_error_looks_like_that(tmp_path):
    (shown,) = re.findall(r"```\n(error.*?)```", README, re.DOTALL)
    path = tmp_path / "demo_msgs" / "msg" / "Scan.msg"
    path.parent.mkdir(parents=True)
    path.write_text("std_msgs/Header header\nflot64[<=3] ranges  # [m]\n", encoding="utf-8")
    done = run("-m", "idlc", "check", "demo_msgs", cwd=tmp_path)
    assert done.returncode == 1
    assert shown in done.stdout + done.stderr


def test_every_make_target_and_command_exists():
    targets = set(re.findall(r"(?:^    |`)make ([a-z-]+)", README, re.MULTILINE))
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert {"demo", "test"} <= targets
    assert targets <= set(re.findall(r"^([a-z-]+):", makefile, re.MULTILINE))
    for command in sorted(set(re.findall(r"^    idlc ([a-z]+) ", README, re.MULTILINE))):
        done = run("-m", "idlc", command, "--help", cwd=ROOT)
        assert done.returncode == 0, command
