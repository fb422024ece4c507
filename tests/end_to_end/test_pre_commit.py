"""The hooks of `.pre-commit-hooks.yaml`, run by pre-commit in the environment that it builds."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.paths import DOCS, ROOT
from tests.support.programs import clean_environment
from tests.support.tools import tool

pytestmark = pytest.mark.long  # pre-commit installs idlc, and what builds it, from a package index
TIDY = "float64 speed  # [m/s]\n"
LOOSE = "float64   speed# [m/s]\n"
FILES = ("pyproject.toml", "README.md", "LICENSE", ".pre-commit-hooks.yaml", "action.yml")


@pytest.fixture(autouse=True, scope="module")
def _git():
    tool("git")


def run(*words, cwd, home):
    """Run a command as in a shell that knows neither this checkout nor the user's settings."""
    environment = {name: v for name, v in clean_environment().items() if not name.startswith("GIT")}
    settings = {"HOME": home, "GIT_CONFIG_NOSYSTEM": "1", "PRE_COMMIT_HOME": home / "pre-commit"}
    who = {
        f"GIT_{role}_{key}": "me" for role in ("AUTHOR", "COMMITTER") for key in ("NAME", "EMAIL")
    }
    return subprocess.run(
        [str(word) for word in words],
        cwd=cwd,
        env={**environment, **{name: str(value) for name, value in settings.items()}, **who},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )


def git(*words, cwd, home):
    done = run("git", *words, cwd=cwd, home=home)
    assert done.returncode == 0, done.stdout
    return done.stdout.strip()


class Team:
    """A repository of interfaces whose commits are checked."""

    def __init__(self, home: Path) -> None:
        self.home = home
        self.folder = home / "team"

    def write(self, path: str, text: str) -> None:
        (self.folder / path).parent.mkdir(parents=True, exist_ok=True)
        (self.folder / path).write_text(text, encoding="utf-8")

    def run(self, *words: str) -> tuple[int, str]:
        """Stage everything and run pre-commit; return its status and what it printed."""
        git("add", "--all", cwd=self.folder, home=self.home)
        command = (sys.executable, "-m", "pre_commit", *words, "--color", "never")
        done = run(*command, cwd=self.folder, home=self.home)
        return done.returncode, done.stdout


def clone(home: Path) -> None:
    """Make a repository that holds the project as it is here."""
    folder = home / "idlc"
    folder.mkdir()
    for name in FILES:
        shutil.copy(ROOT / name, folder)
    ignore = shutil.ignore_patterns("__pycache__")
    for name in ("idlc", "templates", ".ci"):
        shutil.copytree(ROOT / name, folder / name, ignore=ignore)
    git("init", "--quiet", cwd=folder, home=home)
    git("add", "--all", cwd=folder, home=home)
    git("commit", "--quiet", "--message", "all of it", cwd=folder, home=home)


@pytest.fixture(scope="module")
def team(tmp_path_factory):
    """A repository that says what docs/ci.md tells it to, with the environment built."""
    home = tmp_path_factory.mktemp("home")
    clone(home)
    document = (DOCS / "ci.md").read_text(encoding="utf-8")
    settings = document.partition("## pre-commit\n\n```yaml\n")[2].partition("```")[0]
    found = Team(home)
    found.folder.mkdir()
    git("init", "--quiet", cwd=found.folder, home=home)
    found.write(".pre-commit-config.yaml", settings)
    found.write("pyproject.toml", '[tool.idlc]\npaths = ["demo"]\nout = "out/demo"\n')
    found.write("demo/msg/Drive.msg", TIDY)
    status, said = found.run("install-hooks")
    assert status == 0, said
    (idlc,) = (home / "pre-commit").glob("repo*/py_env-*/bin/idlc")
    assert run(idlc, "gen", cwd=found.folder, home=home).returncode == 0
    git("add", "--all", cwd=found.folder, home=home)
    git("commit", "--quiet", "--message", "all of it", cwd=found.folder, home=home)
    return found


@pytest.fixture
def tidy(team):
    """The repository with nothing to complain about, also afterwards."""
    yield team
    git("checkout", "--quiet", "--force", "HEAD", "--", ".", cwd=team.folder, home=team.home)
    shutil.rmtree(team.folder / "other", ignore_errors=True)


def results(said):
    """Return what pre-commit says of each hook."""
    return dict(re.findall(r"(?m)^(idlc .*?)\.{3,}(?:\(.*\))?(\w+)$", said))


HOOKS = ("idlc check", "idlc fmt", "idlc gen")


def test_all_hooks_pass_on_what_is_in_order(tidy):
    status, said = tidy.run("run", "--all-files")
    assert results(said) == dict.fromkeys(HOOKS, "Passed"), said
    assert status == 0


def test_check_fails_on_an_error_and_shows_it(tidy):
    tidy.write("other/msg/Wrong.msg", "flot64 speed\n")
    status, said = tidy.run("run", "--files", "other/msg/Wrong.msg")
    assert status == 1
    # only what cannot be parsed is an error of fmt too
    expected = {"idlc check": "Failed", "idlc fmt": "Passed", "idlc gen": "Passed"}
    assert results(said) == expected, said
    assert "error[IDL201]: unknown type `flot64`" in said
    assert " --> other/msg/Wrong.msg:1:1" in said


def test_many_files_are_one_run(tidy):
    """Otherwise what is wrong with their package would be said several times."""
    files = [f"other/msg/Drive{letter}.msg" for letter in "ABCDEFGHIJKLMNOPQRSTUVWXYZ"]
    tidy.write("other/package.xml", '<package format="3">\n  <name>demo</name>\n</package>\n')
    tidy.write("other/CMakeLists.txt", "rosidl_generate_interfaces(demo ${files})\n")
    for file in files:
        tidy.write(file, TIDY)
    _, said = tidy.run("run", "idlc-check", "--verbose", "--files", *files)
    assert results(said) == {"idlc check": "Passed"}, said
    assert said.count("[IDL453]") == 1, said


@pytest.mark.parametrize("name", ["package.xml", "CMakeLists.txt"])
def test_a_file_that_describes_a_package_is_checked_with_it(name, tidy):
    tidy.write("other/package.xml", '<package format="3">\n  <name>demo</name>\n</package>\n')
    tidy.write("other/CMakeLists.txt", "rosidl_generate_interfaces(demo msg/Wheel.msg)\n")
    tidy.write("other/msg/Drive.msg", TIDY)
    _, said = tidy.run("run", "idlc-check", "--verbose", "--files", f"other/{name}")
    assert results(said) == {"idlc check": "Passed"}, said
    assert "[IDL465]: [*] no such file: `msg/Wheel.msg`" in said
    assert "idlc gen" not in said


def test_one_more_run_is_enough_after_hooks_have_changed_files(tidy):
    """Comments and blanks are part of generated code: it comes after the layout."""
    tidy.write("demo/msg/Drive.msg", LOOSE.replace("[m/s]", "how fast [m/s]"))
    status, said = tidy.run("run", "--all-files")
    assert status == 1
    expected = {"idlc check": "Passed", "idlc fmt": "Failed", "idlc gen": "Failed"}
    assert results(said) == expected, said
    assert said.count("files were modified by this hook") == 2
    tidied = TIDY.replace("[m/s]", "how fast [m/s]")
    assert (tidy.folder / "demo/msg/Drive.msg").read_text() == tidied
    status, said = tidy.run("run", "--all-files")
    assert (status, results(said)) == (0, dict.fromkeys(HOOKS, "Passed")), said


def test_gen_check_fails_on_what_is_not_current_and_says_why(tidy):
    tidy.write("demo/msg/Drive.msg", "float32 speed  # [m/s]\n")
    settings = tidy.folder / ".pre-commit-config.yaml"
    text = settings.read_text(encoding="utf-8")
    tidy.write(".pre-commit-config.yaml", text.replace("idlc-gen\n", "idlc-gen-check\n"))
    status, said = tidy.run("run", "--all-files")
    assert status == 1
    expected = {"idlc check": "Passed", "idlc fmt": "Passed", "idlc gen --check": "Failed"}
    assert results(said) == expected, said
    assert "Drive.msg" in said.partition("idlc gen --check")[2]


def test_a_commit_of_something_else_runs_nothing(tidy):
    tidy.write("other/readme.txt", "nothing of ROS\n")
    status, said = tidy.run("run", "--files", "other/readme.txt")
    assert status == 0
    assert results(said) == dict.fromkeys(HOOKS, "Skipped")


def test_a_real_commit_is_stopped(tidy):
    assert tidy.run("install")[0] == 0
    tidy.write("demo/msg/Drive.msg", "flot64 speed\n")
    git("add", "--all", cwd=tidy.folder, home=tidy.home)
    words = ("git", "commit", "--message", "wrong")
    done = run(*words, cwd=tidy.folder, home=tidy.home)
    assert done.returncode == 1
    assert "error[IDL201]" in done.stdout
    tidy.write("demo/msg/Drive.msg", TIDY)
    tidy.write("pyproject.toml", (tidy.folder / "pyproject.toml").read_text() + "# right\n")
    git("add", "--all", cwd=tidy.folder, home=tidy.home)
    done = run(*words, cwd=tidy.folder, home=tidy.home)
    assert done.returncode == 0, done.stdout
