"""docs/ship-messages.md: its library is built, checked, and installed with ROS 2 and without it."""

import os
import re
import sys
import tarfile

import pytest

from tests.build.test_hooks import tree, write
from tests.build.test_installs import site
from tests.build.test_library import own
from tests.repository.test_wheel import Environment, distributions
from tests.support import programs
from tests.support.paths import DOCS

pytestmark = pytest.mark.long
__all__ = ["distributions"]  # a fixture

PAGE = (DOCS / "ship-messages.md").read_text(encoding="utf-8").partition("## A package for")[0]
FENCES = re.findall(r"^```(\S*)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
FILES = {info: text for info, text in FENCES if "." in info}
PROJECT = {path: text for path, text in FILES.items() if path not in ("show.py", "node.py")}
TYPED, BUILD, TRY, EDITABLE, _ = (text for info, text in FENCES if info == "sh")
ARCHIVES, SHOWN = (text for info, text in FENCES if not info)
(SETUPTOOLS,) = (text for info, text in FENCES if info == "toml")
HATCHLING = FILES["pyproject.toml"].partition("\n[project]")[0]


@pytest.mark.timeout(900)  # it makes four environments and builds in each
@pytest.mark.parametrize("backend", ["hatchling", "setuptools"])
def test_the_page_can_be_followed(backend, distributions, tmp_path, lonely_environment):
    """One test, as building takes longest."""
    folder, variables = build(backend, distributions, tmp_path)
    archives_are_as_shown(folder)
    works_without_ros(folder, variables)
    works_with_ros(folder, tmp_path / "prefix", lonely_environment)
    is_found_if_editable(folder, tmp_path, variables)


def build(backend, distributions, tmp_path):
    """Return the folder of the library, built as the page says, and its author's environment."""
    folder = write(tmp_path / backend, FILES)
    if backend == "setuptools":
        text = FILES["pyproject.toml"].replace(HATCHLING, SETUPTOOLS)
        text = text.replace("[tool.hatch.build.hooks.idlc]\n\n", "")
        (folder / "pyproject.toml").write_text(text)
    (tmp_path / "author").mkdir()
    environment = Environment(tmp_path / "author")
    variables = {
        **programs.clean_environment(),
        "PATH": f"{environment.bin}:{os.environ['PATH']}",
        "PIP_FIND_LINKS": f"{os.environ.get('PIP_FIND_LINKS', '')} {distributions}",
    }
    programs.run("bash", "-ec", TYPED, cwd=folder, environment=variables)
    before = tree(folder)
    programs.run("bash", "-ec", BUILD, cwd=folder, environment=variables)
    after = {path: data for path, data in tree(folder).items() if "dist" not in path.parts}
    assert own(after) == before, "nothing is written into the folder"
    return folder, variables


def archives_are_as_shown(folder):
    assert {f"dist/{path.name}" for path in (folder / "dist").iterdir()} == {*ARCHIVES.split()}
    (sdist,) = folder.glob("dist/*.tar.gz")
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert PROJECT.keys() <= names
    assert not [name for name in names if "trackkit/ros" in name]


def works_without_ros(folder, variables):
    assert programs.run("bash", "-ec", TRY, cwd=folder, environment=variables).endswith(SHOWN)
    (folder / "user.py").write_text("from trackkit import straight\n\nstraight(2)\n")
    mypy = [sys.executable, "-m", "mypy", "--strict", "--python-executable", "plain/bin/python"]
    programs.run(*mypy, "user.py", cwd=folder)


def works_with_ros(folder, prefix, environment):
    pip = [sys.executable, "-m", "pip", "install", "--no-index", "--find-links", "dist"]
    programs.run(*pip, "--no-deps", "--prefix", prefix, "trackkit", cwd=folder)
    environment = {**environment, "PYTHONPATH": str(site(prefix))}
    said = programs.run(sys.executable, "show.py", cwd=folder, environment=environment)
    assert said == SHOWN.replace("trackkit.ros.vendor.", "")
    assert programs.run(sys.executable, "node.py", cwd=folder, environment=environment) == "2.0\n"


def is_found_if_editable(folder, tmp_path, variables):
    environment = Environment(tmp_path)
    variables = {**variables, "PATH": f"{environment.bin}:{variables['PATH']}"}

    def run(*words):
        return programs.run(*words, cwd=folder, environment=variables)

    run("bash", "-ec", EDITABLE)
    assert run("python", "show.py") == SHOWN
    write(folder, {"bad.py": "from trackkit.ros.msg import Track\n\nTrack(points=3)\n"})
    mypy = [sys.executable, "-m", "mypy", "--strict", "--python-executable"]
    _, said = programs.ended(*mypy, environment.bin / "python", "bad.py", cwd=folder)
    assert 'bad.py:3: error: Argument "points" to "Track" has incompatible type "int"' in said
    write(folder, {"src/trackkit/more.py": "from trackkit.ros.msg import Track, Way\n",
                   "interfaces/msg/Way.msg": "int8 a\n"})  # fmt: skip
    more = ("python", "-c", "import trackkit.more")
    status, _ = programs.ended(*more, cwd=folder, environment=variables)
    assert status, "the code is the folder's, the classes are those that were installed"
    run("bash", "-ec", EDITABLE)
    run(*more)
    run("python", "-m", "pip", "uninstall", "--yes", "trackkit")
    packages = environment.folder.glob("venv/lib/*/site-packages/*trackkit*")
    assert not [path for path in packages if not path.is_dir()]
