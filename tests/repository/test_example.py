"""The example is what its README says: its commands and edits, carried out in an empty folder.

`IDLC_REFRESH=example pytest tests/repository/test_example.py` writes the result over the example,
and fails.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.scaffold.test_command import tree
from tests.support import refresh
from tests.support.paths import EXAMPLE, ROOT

README = (EXAMPLE / "README.md").read_text(encoding="utf-8")
IDLC = """
set -e
idlc() { "$PYTHON" -m idlc "$@"; }
"""


def story() -> str:
    """Return the README as a script: its commands, and its diffs as patches."""
    script = IDLC
    for kind, text in re.findall(r"^```(sh|diff)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL):
        script += text if kind == "sh" else f"git apply <<'THE_END'\n{text}THE_END\n"
    return script


@pytest.fixture(scope="module")
def replayed(tmp_path_factory) -> Path:
    """Return the folder that the README's commands make."""
    folder = tmp_path_factory.mktemp("replay")
    environment = {
        **os.environ,
        "PYTHON": sys.executable,
        "PYTHONPATH": str(ROOT),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    done = subprocess.run(
        ["/bin/sh", "-c", story()],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / EXAMPLE.name


def test_the_readme_makes_the_example(replayed):
    found, expected = tree(replayed), tree(EXAMPLE)
    expected.pop("README.md")
    found.pop("README.md")  # which is its package's own
    if refresh.wanted("example"):
        (replayed / "README.md").unlink()
        shutil.copytree(replayed, EXAMPLE, dirs_exist_ok=True)
        for path in expected.keys() - found.keys():
            (EXAMPLE / path).unlink()
        refresh.refreshed()
    assert sorted(found) == sorted(expected)
    lock = json.loads(expected[f"{EXAMPLE.name}/idlc.lock"])
    generated = {f"{EXAMPLE.name}/{path}" for path in ("idlc.lock", *lock["outputs"])}
    for path, text in expected.items():
        if path not in generated:  # those are compared by gen --check, below
            assert found[path] == text, path


def run(*words: str, cwd: Path = EXAMPLE) -> str:
    done = subprocess.run(
        [sys.executable, "-m", *words],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_example_has_nothing_to_be_advised_on():
    assert run("idlc", "check", ".").startswith("no problems")


def test_the_committed_classes_are_up_to_date():
    """After a change of the emitter or the runtime, `make example` writes them anew."""
    run("idlc", "gen", "--check")


def test_the_example_keeps_the_rules_of_style():
    run("ruff", "check", "--no-cache", ".")
    run("ruff", "format", "--check", "--no-cache", ".")


@pytest.mark.ros
def test_the_example_is_typed(tmp_path):
    run("mypy", "--strict", "--cache-dir", str(tmp_path))


def test_every_node_of_the_tutorial_is_there():
    nodes = {
        *("command_publisher", "sensor_publisher", "sensor_subscriber"),
        *("add_two_ints_server", "add_two_ints_client"),
        *("countdown_action_server", "countdown_action_client"),
        *("execute_task_server", "execute_task_client"),
    }
    setup = (EXAMPLE / "setup.py").read_text(encoding="utf-8")
    launch = (EXAMPLE / "launch" / "my_robot_controller_launch.py").read_text(encoding="utf-8")
    for node in nodes:
        assert (EXAMPLE / EXAMPLE.name / f"{node}.py").is_file()
        tests = "test/robust" if node.startswith("execute_task") else "test"
        assert (EXAMPLE / tests / f"test_{node}.py").is_file()
        assert f"'{node} = my_robot_controller.{node}:main'," in setup
        once = node.endswith("_client")  # does one thing and ends, so nothing launches it
        assert (f"executable='{node}'" in launch) == (not once)
