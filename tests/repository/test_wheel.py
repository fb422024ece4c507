"""What is built installs and works without the source tree, whichever lark is on disk."""

import json
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from tests.support import programs
from tests.support.paths import EXAMPLE, ROOT
from tests.support.shared import shared_folder

pytestmark = pytest.mark.long

#: The smallest of ROS 2's wheels that brings lark-parser 0.12 into the folder of lark 1.x.
OLD_LARK = "ros-jazzy-rosidl-parser"

IMPORT_THE_RESULT = """
import sys
from my_robot_controller.action import Countdown
from my_robot_controller.msg import RobotCommand
from my_robot_controller.srv import AddTwoInts

command = RobotCommand(command_type=RobotCommand.MOVE, linear_velocity_x=0.5)
assert RobotCommand.deserialize(command.serialize()) == command
assert AddTwoInts.Request(a=1, b=2).serialize() == bytes.fromhex(
    '00010000' '0100000000000000' '0200000000000000')
assert Countdown.Goal(target_count=3).target_count == 3
assert not {'idlc', 'jinja2', 'lark', 'msgspec', 'numpy'}.intersection(sys.modules)
"""


def source_files() -> dict[str, Path]:
    """Return every file that belongs to the package, by its path in a wheel."""
    folders = {"idlc": ROOT / "idlc", "idlc/templates": ROOT / "templates"}
    found = {
        f"{inside}/{path.relative_to(folder).as_posix()}": path
        for inside, folder in folders.items()
        for path in folder.rglob("*")
        if path.is_file()
    }
    # ruff.toml tells how this repository is linted
    no_part = re.compile(r"/__pycache__/|/\.|/ruff\.toml$")
    return {inside: path for inside, path in found.items() if not no_part.search(inside)}


def run(*command: object, cwd: Path) -> str:
    return programs.run(*command, cwd=cwd, environment=programs.clean_environment())


@pytest.fixture(scope="session")
def distributions(tmp_path_factory) -> Path:
    """Build the sdist, and the wheel from the sdist, from a copy of the sources."""

    def build(out: Path) -> None:
        tree = tmp_path_factory.mktemp("tree")
        for name in ("pyproject.toml", "README.md", "LICENSE"):
            shutil.copy(ROOT / name, tree)
        for name in ("idlc", "templates"):
            shutil.copytree(
                ROOT / name, tree / name, ignore=shutil.ignore_patterns("__pycache__", ".*")
            )
        run(sys.executable, "-m", "build", "--outdir", out, tree, cwd=out.parent)

    return shared_folder(tmp_path_factory, "distributions", build)


class Environment:
    """A virtual environment that knows nothing of this one."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        run(sys.executable, "-m", "venv", folder / "venv", cwd=folder)
        self.bin = folder / "venv" / "bin"

    def install(self, requirement: object) -> None:
        options = ("--quiet", "--disable-pip-version-check")
        run(self.bin / "python", "-m", "pip", "install", *options, requirement, cwd=self.folder)

    def lark(self) -> str:
        code = "import lark; print(lark.__version__)"
        return run(self.bin / "python", "-c", code, cwd=self.folder).strip()

    def compile_and_import(self) -> None:
        """Compile the example with the console script, import the result somewhere else."""
        interfaces = self.folder / "my_robot_controller"
        shutil.copytree(EXAMPLE, interfaces)
        out = self.folder / "out"
        run(self.bin / "idlc", "gen", interfaces, "-o", out / "my_robot_controller", cwd=interfaces)
        run(self.bin / "python", "-c", IMPORT_THE_RESULT, cwd=out)
        odd = self.folder / "odd" / "Odd.msg"  # which lark finds fault with
        odd.parent.mkdir()
        odd.write_text("int8[][] a\n", encoding="utf-8")
        done = subprocess.run(
            [self.bin / "idlc", "check", odd], cwd=odd.parent, capture_output=True, text=True
        )
        assert "IDL103" in done.stdout + done.stderr


def only(folder: Path, pattern: str) -> Path:
    (found,) = folder.glob(pattern)
    return found


def test_the_wheel_holds_the_whole_package_and_nothing_else(distributions):
    with zipfile.ZipFile(only(distributions, "*.whl")) as wheel:
        inside = {name for name in wheel.namelist() if ".dist-info/" not in name}
        licences = [name for name in wheel.namelist() if name.endswith("/LICENSE")]
    assert inside == set(source_files())
    assert licences
    parts = ("grammar.lark", "catalog.json", ".md", "py.typed", ".jinja", "runtime/__init__.py")
    for part in parts:  # the comparison above would not notice a part missing from both
        assert any(name.endswith(part) for name in inside), part


def test_the_sdist_holds_the_whole_package(distributions):
    with tarfile.open(only(distributions, "*.tar.gz")) as sdist:
        inside = {name.partition("/")[2] for name in sdist.getnames()}
    assert {path.relative_to(ROOT).as_posix() for path in source_files().values()} <= inside


def test_a_clean_environment_needs_only_the_wheel(distributions, tmp_path):
    environment = Environment(tmp_path)
    environment.install(only(distributions, "*.whl"))
    environment.compile_and_import()
    versions = {
        run(*words, "--version", cwd=tmp_path)
        for words in (
            [environment.bin / "idlc"],
            [environment.bin / "rosidlc"],
            [environment.bin / "python", "-m", "idlc"],
        )
    }
    assert len(versions) == 1
    known = json.loads((ROOT / "golden/spec/catalog_hashes.json").read_text(encoding="utf-8"))
    hashes = run(
        environment.bin / "idlc", "show", "std_msgs/Header", "--format", "hash", cwd=tmp_path
    )
    assert hashes.split() == [known["std_msgs/msg/Header"], "std_msgs/msg/Header"]


@pytest.mark.ros
def test_ros_may_be_installed_after_idlc(distributions, tmp_path):
    environment = Environment(tmp_path)
    environment.install(only(distributions, "*.whl"))
    environment.install(OLD_LARK)
    assert environment.lark().startswith("0.12")
    environment.compile_and_import()


@pytest.mark.ros
def test_ros_may_be_installed_before_idlc(distributions, tmp_path):
    environment = Environment(tmp_path)
    environment.install(OLD_LARK)
    environment.install(only(distributions, "*.whl"))
    assert environment.lark().startswith("1.")
    environment.compile_and_import()
