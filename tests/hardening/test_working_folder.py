"""idlc in a folder of somebody else: what lies there is read, and neither imported nor started."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.files import write
from tests.support.paths import ROOT
from tests.support.programs import clean_environment, run
from tests.support.repositories import changed

#: What else may be imported: what idlc needs, can use, or was built with.
OTHERS = """
click msgspec jinja2 markupsafe yaml tomli numpy pyarrow zstandard lz4 fsspec rclpy hatchling
setuptools pytest pluggy ament_index_python usercustomize sitecustomize p attacker typing_extensions
""".split()
#: What Python itself imports, with the working folder first, before a module of `-m` gets to run.
BEFORE = {"runpy", "importlib", "pkgutil"}
COMMANDS = {
    "check": ["check", "."],
    "check as json": ["check", "--format", "json", "."],
    "fmt": ["fmt", "."],
    "gen": ["gen", "p", "-o", "out/p"],
    "show": ["show", "p/msg/A.msg"],
    "docs": ["docs", "p", "-o", "site"],
    "breaking": ["breaking", "p", "--against", "git:HEAD~1"],
    "node": ["scaffold", "node", "talk", "--publish", "std_msgs/msg/String:/x"],
    "explain": ["explain", "IDL101"],
    "help": ["--help"],
    "server": ["lsp", "--check"],
}


@pytest.fixture(scope="module")
def theirs(tmp_path_factory):
    """A repository with a module for everything that could be imported, and with programs."""
    tmp_path = tmp_path_factory.mktemp("working")
    folder = changed(tmp_path / "theirs")
    write(folder / "package.xml", "<package><name>talker</name></package>")
    write(folder / "setup.py", "from attacker import setup\nsetup(entry_points={})\n")
    for name in sorted({*sys.stdlib_module_names, *OTHERS} - {"__future__", "antigravity", "this"}):
        write(folder / f"{name}.py", f"open({str(tmp_path / 'ran')!r}, 'a').write('{name} ')\n")
    for name in ("git", "git.exe", "python", "python3", "sh", "idlc"):
        write(folder / name, f"#!/bin/sh\necho {name} >>{tmp_path / 'ran'}\n")
        (folder / name).chmod(0o755)
    return folder


def ran(folder, *command):
    subprocess.run(
        command,
        cwd=folder,
        env=clean_environment(),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        check=False,
    )
    mark = folder.parent / "ran"
    found = mark.read_text().split() if mark.exists() else []
    mark.unlink(missing_ok=True)
    return found


@pytest.mark.parametrize("words", COMMANDS.values(), ids=COMMANDS)
def test_the_command_imports_and_starts_nothing_of_the_working_folder(theirs, words):
    assert ran(theirs, str(Path(sys.executable).with_name("idlc")), *words) == []


@pytest.mark.parametrize("words", COMMANDS.values(), ids=COMMANDS)
def test_python_m_leaves_the_working_folder_as_soon_as_it_can(theirs, words):
    """What Python imports before that, `-P` or `-I` keeps out."""
    safe = "-I" if sys.version_info < (3, 11) else "-P"
    assert ran(theirs, sys.executable, safe, "-m", "idlc", *words) == []
    assert set(ran(theirs, sys.executable, "-m", "idlc", *words)) <= BEFORE


def test_python_m_in_a_checkout_is_that_of_the_checkout(tmp_path):
    shutil.copytree(ROOT / "idlc", tmp_path / "idlc", ignore=shutil.ignore_patterns("__pycache__"))
    about = tmp_path / "idlc/version.py"
    about.write_text(re.sub('__version__ = ".*"', '__version__ = "9.9"', about.read_text()))
    assert run(sys.executable, "-m", "idlc", "--version", cwd=tmp_path) == "idlc 9.9\n"
