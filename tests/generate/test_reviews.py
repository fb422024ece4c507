"""What a person reviews of generated code is short, and short is what a change makes of it."""

import shutil
import subprocess
import sys

import pytest

from tests.support.paths import EXAMPLE
from tests.support.tools import tool

MODULE = "my_robot_controller/action/_countdown.py"


@pytest.fixture(autouse=True, scope="module")
def _git():
    tool("git")


def run(*command, cwd):
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def reviewed_changes(folder):
    """Return the lines added and removed in each file that a person reviews."""
    found = {}
    for line in run("git", "diff", "--numstat", cwd=folder).splitlines():
        added, removed, path = line.split("\t")
        if not run("git", "check-attr", "linguist-generated", path, cwd=folder).endswith(": set\n"):
            found[path] = int(added) + int(removed)
    return found


def test_the_module_of_an_action_is_short():
    assert len((EXAMPLE / MODULE).read_text(encoding="utf-8").splitlines()) < 150


def test_one_more_field_changes_few_lines_that_are_reviewed(tmp_path):
    folder = tmp_path / "my_robot_controller"
    shutil.copytree(EXAMPLE, folder, ignore=shutil.ignore_patterns("__pycache__"))
    run("git", "init", "-q", cwd=folder)
    run("git", "add", "-A", cwd=folder)
    source = folder / "action" / "Countdown.action"
    goal, end, rest = source.read_text(encoding="utf-8").partition("---\n")
    source.write_text(f"{goal}float64 period  # Time between counts [s]\n{end}{rest}", "utf-8")
    run(sys.executable, "-m", "idlc", "gen", cwd=folder)
    changes = reviewed_changes(folder)
    assert set(changes) == {"action/Countdown.action", MODULE}
    assert sum(changes.values()) <= 15, changes
    marked = run("git", "diff", "--name-only", cwd=folder).split()
    assert f"{MODULE.removesuffix('.py')}__codec.py" in marked
