"""Candidates that run in a process of their own."""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage

ROOT = Path(__file__).resolve().parents[1]
#: Programs start from bytecode, as they do where they are installed.
ENVIRONMENT = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}


def run(words: Sequence[object], folder: Path, **variables: str) -> str:
    """Run a program, with more environment variables, and return what it prints."""
    command = list(map(str, words))
    environment = ENVIRONMENT | variables
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, env=environment
    )
    assert done.returncode == 0, (command, done.stdout[-1000:], done.stderr[-3000:])
    return done.stdout


def seconds(words: Sequence[object], folder: Path) -> float:
    """Return the CPU time, user and system, that a program takes with all that it starts."""
    before = getrusage(RUSAGE_CHILDREN)
    run(words, folder)
    after = getrusage(RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def plain_python(folder: Path) -> Path:
    """Make an interpreter that borrows the packages of this one, without their start-up hooks.

    The wheels of ROS make every interpreter start twice.
    """
    run([sys.executable, "-m", "venv", "--without-pip", folder], folder.parent)
    (site,) = folder.glob("lib/python*/site-packages")
    packages = [path for path in sys.path if path.endswith("site-packages")]
    (site / "borrowed.pth").write_text("\n".join([str(ROOT), *packages]), encoding="utf-8")
    return folder / "bin" / "python"
