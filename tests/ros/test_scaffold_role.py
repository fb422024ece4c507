"""docs/contributing/add.md holds for roles: what it lists is all that a new role takes."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support import programs
from tests.support.paths import DOCS, ROOT
from tests.support.tools import tool

pytestmark = pytest.mark.long

GUIDE = DOCS / "contributing" / "add.md"


def blocks() -> dict[str, str]:
    """Return the guide's blocks of code by what they are marked with."""
    text = GUIDE.read_text(encoding="utf-8").partition("\n## Add a role\n")[2]
    text = text.partition("\n## ")[0]
    found = re.findall(r"^   ```(\S+)\n(.*?)^   ```$", text, re.MULTILINE | re.DOTALL)
    return {head: re.sub(r"(?m)^ {3}", "", body) for head, body in found}


@pytest.fixture(scope="module")
def idlc(tmp_path_factory) -> Path:
    """Return a folder with a copy of idlc that has the guide's role."""
    folder = tmp_path_factory.mktemp("idlc")
    ignore = shutil.ignore_patterns("__pycache__")
    for name in ("idlc", "templates"):
        shutil.copytree(ROOT / name, folder / name, ignore=ignore)
    files = blocks()
    diff = files.pop("diff")
    for path, text in files.items():
        assert not (folder / path).exists()
        (folder / path).write_text(text, encoding="utf-8")
    subprocess.run([tool("git"), "apply", "-"], input=diff, text=True, check=True, cwd=folder)
    return folder


@pytest.fixture(scope="module")
def package(idlc, tmp_path_factory) -> Path:
    """Return a package with nodes in the guide's role."""
    folder = tmp_path_factory.mktemp("package")
    run = [sys.executable, "-m", "idlc", "scaffold"]
    environment = {**os.environ, "PYTHONPATH": str(idlc), "PYTHONDONTWRITEBYTECODE": "1"}
    programs.run(*run, "package", "demo", cwd=folder, environment=environment)
    echo = ["--echo", "std_msgs/String:chatter", "--timer", "0.5"]
    for words in (["plain", *echo, "--qos", "sensor_data"], ["managed", *echo, "--lifecycle"]):
        programs.run(*run, "node", *words, cwd=folder / "demo", environment=environment)
    return folder / "demo"


def test_it_takes_a_row_and_a_template():
    assert set(blocks()) == {"diff", "templates/node/echo.py.jinja"}


def test_its_row_is_clean(idlc):
    path = idlc / "idlc/scaffold/roles.py"
    for words in (["check"], ["format", "--check"]):
        command = [sys.executable, "-m", "ruff", *words, "--no-cache", "--isolated"]
        programs.run(*command, "--line-length=100", path, cwd=idlc, environment={**os.environ})


def test_the_command_line_knows_it(idlc, tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(idlc)}
    command = [sys.executable, "-m", "idlc", "scaffold", "node"]
    said = programs.run(*command, "--help", cwd=tmp_path, environment=environment)
    assert re.search(r"--echo TYPE:TOPIC +Publish each message again, on\s+echo/TOPIC\.", said)


@pytest.mark.parametrize(
    "words",
    [
        ["ruff", "check", "--no-cache", "."],
        ["ruff", "format", "--check", "--no-cache", "."],
        pytest.param(["mypy", "--strict"], marks=pytest.mark.jazzy),
        ["pytest", "-q", "-p", "no:cacheprovider", "test/robust"],
    ],
    ids=["ruff check", "ruff format", "mypy", "pytest"],
)
def test_its_nodes_are_clean_and_work(package, words):
    programs.run(sys.executable, "-m", *words, cwd=package, environment={**os.environ})
