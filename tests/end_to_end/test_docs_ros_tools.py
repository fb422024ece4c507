"""docs/ros-tools.md and docs/ship-messages.md: what can run here is run."""

import importlib.util
import os
import re
import sys
from pathlib import Path

import pytest

from tests.build.test_hooks import BUILD, FILES, built, read, write
from tests.build.test_installs import site
from tests.support.paths import DOCS, ROOT
from tests.support.programs import ended

TOOLS = (DOCS / "ros-tools.md").read_text(encoding="utf-8")
PACKAGES = (
    (DOCS / "ship-messages.md").read_text(encoding="utf-8").partition("\n## A package for")[2]
)
PACKAGES = PACKAGES.partition("\n## ")[0]
#: Where pip and uv install for a test, with the idlc and hatchling of this environment.
OFFLINE = {"PIP_NO_INDEX": "1", "PIP_NO_DEPS": "1", "PIP_NO_BUILD_ISOLATION": "0"}


def rows(text, heading):
    """Return the cells of the table with a heading."""
    _, _, rest = text.partition(heading)
    table = rest.partition("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table]


TABLE = rows(TOOLS, "| tool | works | evidence | command |")


def blocks(text, language):
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def shell(commands, folder, **environment):
    """Run commands as a shell does that stops at the first failure; return what they print."""
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    given = {**os.environ, "PATH": path, **OFFLINE, **environment}
    status, said = ended("bash", "-ec", commands, cwd=folder, environment=given)
    assert status == 0, said
    return said


def test_every_line_says_how_it_is_known():
    tools = " ".join(tool for tool, *_ in TABLE)
    for tool in (
        *("`ros2 topic`", "`ros2 interface`", "`ros2 bag record`", "foxglove_bridge", "rqt_topic"),
        *("rosbridge_suite", "PlotJuggler", "RViz", "topic_tools", "domain_bridge", "C++"),
    ):
        assert tool in tools
    for tool, works, known, _ in TABLE:
        assert works, tool
        ways = [part.partition(":") for part in known.split("; ")]
        assert {way for way, _, _ in ways} <= {"tested", "run", "read"}, tool
        for way, _, how in ways:
            assert way == "read" or how, f"{tool}: which test, or which version?"
            if way == "tested":
                (test,) = re.findall(r"`(tests/[\w/.]+)`", how)
                assert (ROOT / test).is_file(), test


def test_commands_are_commands():
    for tool, _, _, command in TABLE:
        assert not command or re.fullmatch(r"`(ros2|colcon|idlc) [\w./:, *-]+`", command), tool


def test_a_package_is_found_as_is_said(tmp_path):
    (commands,) = blocks(TOOLS.partition("## Let tools find")[2], "sh")
    prefix = tmp_path / "prefix"
    # this environment cannot be installed into: the prefix is another one
    commands = commands.replace("$(python -c 'import sys; print(sys.prefix)')", str(prefix))
    if importlib.util.find_spec("ament_index_python"):
        find = "from ament_index_python import get_resource as g; print(*g('packages', 'my_msgs'))"
        commands += f'python -c "{find}"\n'
    said = shell(commands, tmp_path, PIP_PREFIX=str(prefix), PYTHONPATH=str(site(prefix)))
    assert "my_msgs.msg.Drive(speed=1.5)\n" in said
    assert not commands.endswith('"\n') or said.endswith(f" {prefix}\n")


def test_the_file_that_is_needed_is_the_one_shown(tmp_path, monkeypatch):
    shown, project, cache = blocks(PACKAGES, "toml")
    assert shown == BUILD
    template = (ROOT / "templates/package/interfaces_pyproject.toml.jinja").read_text()
    assert cache.partition("\n")[2] in template
    files = {**FILES, "pyproject.toml": f"{shown}\n{project}"}
    monkeypatch.chdir(write(tmp_path / "demo_msgs", files))
    _, metadata = read(built(tmp_path))
    assert metadata.get_all("Requires-Dist") == ["base-msgs", "numpy"]
    assert metadata["License-Expression"] == "MIT"


def test_the_commands_shown_install_the_folder(tmp_path):
    (commands,) = blocks(PACKAGES, "sh")
    (scaffold,) = re.findall(r"^    (idlc scaffold .*)$", PACKAGES, re.MULTILINE)
    wanted = [line for line in commands.splitlines() if not line.startswith("uv")]
    assert len(wanted) == 3
    script = "\n".join([scaffold, *wanted]).replace("-m build ", "-m build --no-isolation ")
    prefix = tmp_path / "prefix"
    shell(script, tmp_path, PIP_PREFIX=str(prefix), PIP_IGNORE_INSTALLED="1")
    assert (site(prefix) / "my_msgs" / "msg" / "__init__.py").is_file()
    assert len(list((tmp_path / "my_msgs" / "dist").iterdir())) == 2


REPORT = """\
error[IDL201]: unknown type `flot32`
 --> msg/Drive.msg:1:1
  |
1 | flot32 speed
  | ^^^^^^
  = hint: did you mean `float32`?
"""


def test_a_build_reports_what_is_wrong(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(write(tmp_path / "my_msgs", {**FILES, "msg/Drive.msg": "flot32 speed\n"}))
    with pytest.raises(SystemExit):
        built(tmp_path)
    assert REPORT in capfd.readouterr().err
