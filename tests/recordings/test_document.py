"""The examples of docs/recordings.md about types, as pasted into a shell."""

import os
import re
import subprocess
import sys

import pytest

from tests.support import recorded_text
from tests.support.paths import DOCS, ROOT

PAGE = (DOCS / "recordings.md").read_text(encoding="utf-8").partition("## List topics and types")[2]
EXAMPLES = re.findall(r"^```console\n\$ (.*)\n((?:.*\n)*?)```$", PAGE, re.MULTILINE)
DEFINITION = "{0}[4] speed  # forward [m/s]\n"
DRIVE = f"@ /wheels demo_msgs/msg/Wheels\n{DEFINITION.format('float64')}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("document")
    for path in ("bags", "src/demo_msgs/msg"):
        (folder / path).mkdir(parents=True)
    name = "@ /name std_msgs/msg/String ros2msg right\nstring data\n"
    recorded_text.write(folder / "drive.mcap", DRIVE + name, {"/wheels": 200, "/name": 20})
    recorded_text.write(folder / "bags/spring.mcap", DRIVE)
    recorded_text.write(folder / "bags/autumn.mcap", name)
    text = DEFINITION.format("float32")
    (folder / "src/demo_msgs/msg/Wheels.msg").write_text(text, encoding="utf-8")
    return folder


def test_the_examples_print_what_the_page_shows(folder):
    # in their order: one reads what another has written
    for command, expected in EXAMPLES:
        check(command, expected, folder)


def check(command, expected, folder):
    python = f"'{sys.executable}'"
    functions = f'idlc() {{ {python} -m idlc "$@"; }}\npython() {{ {python} "$@"; }}\n'
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = command.replace("PYTHONPATH=", f"PYTHONPATH={ROOT}:")
    done = subprocess.run(
        ["/bin/sh", "-c", functions + command],
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
        env=environment,
    )
    assert "Traceback" not in done.stderr
    assert re.sub(r"→ \d+ files", "→ N files", done.stdout) == re.sub(
        r"→ \d+ files", "→ N files", expected
    ), done.stderr


def test_there_are_examples():
    assert len(EXAMPLES) >= 5
