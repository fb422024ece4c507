"""`idlc scaffold`: what it writes, that it writes it once, and that it never writes a half.

`IDLC_REFRESH='scaffold/*' pytest tests/scaffold/test_command.py` rewrites the trees in
golden/scaffold that match, and fails, so that the changes are looked at.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from catkin_pkg.package import parse_package

from idlc.cli.main import main
from idlc.project.lock import BUILD_STEP
from idlc.scaffold.roles import ROLES
from tests.support import refresh
from tests.support.paths import GOLDEN
from tests.support.tools import tool

FOLDER = GOLDEN / "scaffold"
CASES = sorted(path.parent for path in FOLDER.glob("*/commands"))
#: Caches.
#: Caches, and a copy of a file of idlc.
_UNREAD = {"__pycache__", ".mypy_cache", ".ruff_cache", BUILD_STEP}


def tree(folder: Path) -> dict[str, str]:
    return {
        path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8")
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not _UNREAD & set(path.parts)
    }


def carry_out(commands: str, monkeypatch) -> None:
    for line in commands.splitlines():
        program, *words = shlex.split(line)
        if program == "cd":
            monkeypatch.chdir(words[0])
        else:
            assert main(words) == 0, line


@pytest.fixture(autouse=True)
def nothing_installed(monkeypatch):
    """Types come from the catalogue and no name from git, so that every machine writes the same."""
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", os.devnull)
    monkeypatch.setenv("GIT_CONFIG_NOSYSTEM", "1")
    monkeypatch.setattr("idlc.project.prefixes.ament_prefixes", lambda: ())


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_golden_tree(case, tmp_path, monkeypatch):
    commands = (case / "commands").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    if (case / "in").is_dir():
        shutil.copytree(case / "in", tmp_path, dirs_exist_ok=True)
    carry_out(commands, monkeypatch)
    found = tree(tmp_path)
    monkeypatch.chdir(tmp_path)
    carry_out(commands, monkeypatch)
    assert tree(tmp_path) == found, "the second time changed something"
    if refresh.wanted(f"scaffold/{case.name}"):
        shutil.rmtree(case / "out", ignore_errors=True)
        shutil.copytree(tmp_path, case / "out", ignore=shutil.ignore_patterns(*_UNREAD))
        refresh.refreshed()
    expected = tree(case / "out")
    assert sorted(found) == sorted(expected)
    for path, text in expected.items():
        assert found[path] == text, path


def test_each_role_has_a_golden_tree():
    commands = "".join((case / "commands").read_text(encoding="utf-8") for case in CASES)
    assert [role.name for role in ROLES if f"{role.option} " not in commands] == []


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_golden_packages_are_valid(case):
    for manifest in (case / "out").glob("*/package.xml"):
        package = parse_package(manifest)
        package.validate()
        assert package.get_build_type() in ("ament_python", "ament_cmake")


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_golden_packages_pass_the_checks_of_style(case, tmp_path):
    shutil.copytree(case / "out", tmp_path / "out")
    for path in (case / "in").rglob("*.py"):  # the user's own style is the user's
        (tmp_path / "out" / path.relative_to(case / "in")).unlink()
    for package in sorted((tmp_path / "out").glob("*")):
        ours = package / "pyproject.toml"
        style = [] if ours.is_file() else ["--config", str(FOLDER / "package/out/demo" / ours.name)]
        for words in (
            ["ruff", "check", "."],
            ["ruff", "check", "--select=D401", "."],  # which ament_pep257 wants
            ["ruff", "format", "--check", "."],
        ):
            done = subprocess.run(
                [sys.executable, "-m", *words, *style, "--no-cache"],
                cwd=package,
                capture_output=True,
                text=True,
                check=False,
            )
            assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture
def package(tmp_path, monkeypatch) -> Path:
    """Return a new package, in which the test works."""
    monkeypatch.chdir(tmp_path)
    assert main(["scaffold", "package", "demo"]) == 0
    monkeypatch.chdir("demo")
    return tmp_path / "demo"


NODE = ["scaffold", "node", "talker", "--publisher", "std_msgs/String:chatter"]


def test_a_dry_run_shows_what_patch_would_need(package, capsys):
    before = tree(package)
    capsys.readouterr()
    assert main([*NODE, "--diff"]) == 0
    diff = capsys.readouterr().out
    assert tree(package) == before
    subprocess.run([tool("git"), "apply", "-"], input=diff, text=True, check=True, cwd=package)
    patched = tree(package)
    assert patched != before
    assert main(NODE) == 0
    assert tree(package) == patched


def test_an_edited_node_is_refused_and_forced_with_a_copy(package, capsys):
    assert main(NODE) == 0
    module = package / "demo" / "talker.py"
    mine = module.read_text().replace("'hello'", "'goodbye'")
    module.write_text(mine)
    before = tree(package)
    assert main([*NODE, "--timer", "1"]) == 1
    assert "IDL620" in capsys.readouterr().err
    assert tree(package) == before
    assert main([*NODE, "--timer", "1", "--force"]) == 0
    assert (package / "demo" / "talker.py.bak").read_text() == mine
    assert "def tick" in module.read_text()


def test_nothing_is_written_when_one_file_cannot_be_edited(package, capsys):
    setup = package / "setup.py"
    setup.write_text(setup.read_text().replace("'console_scripts': [", "'console_scripts': list(["))
    setup.write_text(setup.read_text().replace("],\n    },", "]),\n    },"))
    before = tree(package)
    assert main(NODE) == 1
    assert "'talker = demo.talker:main'," in capsys.readouterr().err
    assert tree(package) == before


def test_files_keep_their_mode(package):
    (package / "setup.py").chmod(0o755)
    assert main(NODE) == 0
    assert (package / "setup.py").stat().st_mode & 0o777 == 0o755


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["node", "Talker"], "cannot be a node"),
        (["node", "class"], "cannot be a node"),
        (["node", "msg"], "has this name"),
        (["node", "signal"], "has this name"),
        (["node", "a", "--publisher", "String"], "TYPE:TOPIC"),
        (["node", "a", "--publisher", "std_msgs/String:a@0"], "above 0"),
        (["node", "a", "--publisher", "std_msgs/String:1a"], "cannot be the name"),
        (["node", "a", "--publisher", "std_msgs/Strin:a"], "did you mean `std_msgs/msg/String`"),
        (["node", "a", "--service", "Nothing:a"], "idlc scaffold interface srv Nothing"),
        (["node", "a", "--qos", "latched"], "must follow its endpoint"),
        (["node", "a", "--publisher", "std_msgs/String:a", "--qos", "best"], "--qos is one of"),
        (["node", "a", "--service", "std_srvs/Empty:a", "--qos", "latched"], "--qos is for"),
        (["node", "a", "--timer", "1", "--qos", "latched"], "must follow its endpoint"),
        (["node", "a", "--publisher", "std_msgs/String:a\0qos=latched"], "cannot be the name"),
        (["node", "a", "--param", "x"], "NAME:TYPE=DEFAULT"),
        (["node", "a", "--param", "x:int=1.5"], "needs an integer, not `1.5`"),
        (["node", "a", "--timer", "soon"], "number of seconds"),
        (["interface", "msg", "my_message", "int8 a"], "cannot be an interface"),
        (["interface", "msg", "Message", "int8 a", "---", "int8 b"], "one `---` too many"),
        (
            ["interface", "srv", "Ask", "int8 a", *["---", "int8 b"] * 2],
            "has 2 parts, here are 3",
        ),
        (["interface", "msg", "Message", "int8 a\nint8 b"], "a field must be one line"),
        (["interface", "msg", "Message", "flot32 a"], "IDL201"),
        (["node", "a", "--publisher", "String:a"], "or `std_msgs/String`?"),
        (["node", "a", "--publisher", "std_srvs/SetBool:a"], "service: use --service or --client"),
        (["node", "a", "--client", "std_msgs/String:a"], "message: use --publisher or --subscri"),
        (["package", "Demo"], "is not a package name\n  = hint: use lower-case letters"),
        (["package", "test"], "is the name of a folder or module"),
        (["package", "launch"], "is the name of a folder or module"),
    ],
)
def test_wrong_words_are_explained_and_change_nothing(package, capsys, words, said):
    before = tree(package)
    status = main(["scaffold", *words])
    output = capsys.readouterr()
    assert status in (1, 2)
    assert said in output.err
    assert "Traceback" not in output.err
    assert tree(package) == before


def test_outside_of_a_package(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / ".git").mkdir()
    assert main(NODE) == 2
    assert "idlc scaffold package NAME" in capsys.readouterr().err


@pytest.mark.parametrize("folder", ["out/demo", "out/demo/msg"])
def test_no_package_begins_among_generated_code(folder, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "demo" / "msg").mkdir(parents=True)
    (tmp_path / "demo" / "msg" / "Drive.msg").write_text("float64 speed\n", encoding="utf-8")
    assert main(["gen", "demo", "-o", "out/demo"]) == 0
    monkeypatch.chdir(folder)
    before = tree(tmp_path)
    assert main(["scaffold", "package", "arm"]) == 1
    assert tree(tmp_path) == before
    (way,) = re.findall("`cd (.*)`", capsys.readouterr().err)
    monkeypatch.chdir(way)
    assert Path.cwd() == tmp_path / "out"
    assert main(["scaffold", "package", "arm"]) == 0


def test_the_wizard_asks_for_the_same(package, monkeypatch):
    from click.testing import CliRunner

    from idlc.cli.scaffold_node import command

    answers = ["1", "std_msgs/Strin", "Imu:imu@50", "std_srvs/Empty", "std_msgs/String"]
    answers += ["bad topic", "chatter", "often", "2", "latched", "timer", "soon", "0.5"]
    answers += ["8", "speed", "speed:int=3", "", "n"]
    monkeypatch.setattr("idlc.cli.run.scaffold.interactive", lambda: True)
    result = CliRunner().invoke(command, ["asker"], input="\n".join(answers) + "\n")
    assert result.exception is None or isinstance(result.exception, SystemExit), result.output
    complaints = [line for line in result.output.splitlines() if "Error: " in line]
    wrong = ["did you mean `std_msgs/msg/String`", "`Imu:imu@50`", "it is a service", "`bad topic`"]
    wrong += ["not `often`", "not `soon`", "`speed` is not NAME:TYPE=DEFAULT"]
    for complaint, what in zip(complaints, wrong, strict=True):  # each when it is given
        assert what in complaint
    asked = (package / "demo" / "asker.py").read_text()
    words = ["--publisher", "std_msgs/String:chatter@2", "--qos", "latched", "--timer", "0.5"]
    assert main(["scaffold", "node", "typer", *words, "--param", "speed:int=3"]) == 0
    typed = (package / "demo" / "typer.py").read_text()
    assert asked.replace("asker", "typer").replace("Asker", "Typer") == typed


def test_the_maintainer_is_whom_git_knows(tmp_path, monkeypatch):
    tool("git")
    config = tmp_path / "config"
    config.write_text("[user]\n\tname = \"Ada <L> & 'co'\"\n\temail = ada@example.com\n")
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", str(config))
    monkeypatch.chdir(tmp_path)
    assert main(["scaffold", "package", "demo"]) == 0
    (maintainer,) = parse_package(tmp_path / "demo").maintainers
    assert (maintainer.name, maintainer.email) == ("Ada <L> & 'co'", "ada@example.com")
    assert main(["scaffold", "package", "other", "--maintainer", "Bo <b@c.de>"]) == 0
    assert "Bo" in (tmp_path / "other/setup.py").read_text()


def test_a_package_of_interfaces_has_one_to_begin_with(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    package = ["scaffold", "package", "--interfaces", "demo_msgs"]
    assert main([*package, "--diff"]) == 0
    assert "+++ b/demo_msgs/msg/Example.msg" in capsys.readouterr().out
    assert not (tmp_path / "demo_msgs").exists()
    assert main(package) == 0
    assert (tmp_path / "demo_msgs/CMakeLists.txt").is_file()
    parse_package(tmp_path / "demo_msgs").validate()
    assert main(["check", "demo_msgs"]) == 0
    assert "no problems in 1 file" in capsys.readouterr().out
    # none is added to others, so that the command can be run again
    (tmp_path / "demo_msgs/msg/Example.msg").rename(tmp_path / "demo_msgs/msg/Drive.msg")
    assert main(package) == 0
    assert "nothing to do" in capsys.readouterr().out


@pytest.mark.parametrize("word", ["drive", "x/Drive", "../Drive", "srv/../Drive", "msg/", "a b"])
def test_interfaces_to_begin_with_have_names(word, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["scaffold", "package", "--interfaces", "demo_msgs", word]) == 2
    assert capsys.readouterr().err.startswith("error: ")
    assert not list(tmp_path.iterdir())


def test_interfaces_to_begin_with_are_for_packages_of_interfaces(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["scaffold", "package", "demo", "Drive"]) == 2
    assert "needs --interfaces" in capsys.readouterr().err


def test_a_launch_file_that_cannot_be_edited_leaves_the_rest(package, capsys):
    launch = package / "launch" / "demo_launch.py"
    text = "from launch import LaunchDescription\n\nx = LaunchDescription(nodes())\n"
    launch.write_text(text)
    assert main(NODE) == 0
    said = capsys.readouterr().out
    line = "Node(package='demo', executable='talker', output='screen')"
    assert "note: `launch/demo_launch.py` is not edited: " in said
    assert line in said
    assert launch.read_text() == text
    assert "talker = demo.talker:main" in (package / "setup.py").read_text()
    assert (package / "demo" / "talker.py").is_file()


def test_the_launch_file_is_for_nodes_that_stay(package):
    launch = package / "launch" / "demo_launch.py"
    before = launch.read_text()
    assert main(["scaffold", "node", "once", "--client", "std_srvs/Empty:reset"]) == 0
    assert launch.read_text() == before
    assert main(["scaffold", "node", "keeper", "--lifecycle", "--timer", "1"]) == 0
    after = launch.read_text()
    assert "from launch_ros.actions import LifecycleNode\n" in after
    assert "LifecycleNode(" in after
    assert "namespace=''" in after


@pytest.mark.parametrize("ours", [True, False])
def test_the_next_command_is_one_that_works(package, capsys, monkeypatch, tmp_path, ours):
    tools = tmp_path / "tools"
    tools.mkdir()
    for name in ("idlc", "rosidlc"):
        mine = ours if name == "idlc" else True
        text = "from idlc.cli.main import main" if mine else "the one of Cyclone DDS"
        (tools / name).write_text(f"#!/bin/sh\n# {text}\n")
        (tools / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(tools))
    called = "idlc" if ours else "rosidlc"
    assert main(["scaffold", "interface", "msg", "Drive", "float32 speed"]) == 0
    assert f"next: {called} gen\n" in capsys.readouterr().out
    (package / "pyproject.toml").unlink()
    assert main(["scaffold", "interface", "msg", "Other", "float32 speed"]) == 0
    assert f"next: {called} gen . -o demo\n" in capsys.readouterr().out
    assert main(["gen", ".", "-o", "demo"]) == 0
    (tools / "rosidlc").unlink()
    (tools / "idlc").unlink()
    assert main(["scaffold", "interface", "msg", "Third", "float32 speed"]) == 0
    assert "-m idlc gen . -o demo\n" in capsys.readouterr().out


CHOICES = {
    "--maintainer": ("Lena & K", "maintainer="),
    "--maintainer ": ("<lena@example.com>", "maintainer_email="),
    "--license": ("MIT", "license="),
}


@pytest.mark.parametrize("option", CHOICES)
def test_what_an_existing_package_says_otherwise_is_reported(option, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = ["scaffold", "package", "demo"]
    assert main(words) == 0
    before = tree(tmp_path)
    capsys.readouterr()
    value, argument = CHOICES[option]
    assert main([*words, option.strip(), value]) == 1
    assert tree(tmp_path) == before
    said = capsys.readouterr().err
    assert "nothing was written" in said
    # what the hints say is all there is to do
    for file, start in (("package.xml", "<"), ("setup.py", argument)):
        (line,) = re.findall(rf"demo/{file}:(\d+):", said)
        (new,) = re.findall(rf"write `({start}.*)`$", said, re.MULTILINE)
        lines = before[f"demo/{file}"].splitlines()
        lines[int(line) - 1] = f"  {new}" + "," * (file == "setup.py")
        (tmp_path / "demo" / file).write_text("\n".join(lines) + "\n")
    if option == "--license":
        (tmp_path / "demo/LICENSE").unlink()
    assert main([*words, option.strip(), value]) == 0
    parse_package(tmp_path / "demo").validate()


def test_choices_that_setup_py_computes_are_left_alone(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = ["scaffold", "package", "demo"]
    assert main([*words, "--maintainer", "Bo"]) == 0
    setup = tmp_path / "demo/setup.py"
    setup.write_text(setup.read_text().replace("maintainer='Bo'", "maintainer=name()"))
    assert main([*words, "--maintainer", "Bo"]) == 0
    assert "nothing to do" in capsys.readouterr().out


def test_a_package_of_another_kind_is_left_alone(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["scaffold", "package", "demo"]) == 0
    before = tree(tmp_path)
    assert main(["scaffold", "package", "demo", "--interfaces"]) == 1
    assert "the build type is `ament_python` here" in capsys.readouterr().err
    assert tree(tmp_path) == before


def test_interfaces_for_a_package_that_has_others_are_reported(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = ["scaffold", "package", "--interfaces", "demo_msgs", "Drive"]
    assert main(words) == 0
    assert main(words) == 0
    assert main([*words, "srv/Ask"]) == 1
    said = capsys.readouterr().err
    commands = re.search("run `cd (.*)`, then `idlc (.*)`", said)
    monkeypatch.chdir(commands[1])
    assert main(shlex.split(commands[2])) == 0
    monkeypatch.chdir(tmp_path)
    assert main([*words, "srv/Ask"]) == 0


@pytest.mark.parametrize("is_there", [True, False])
def test_what_comes_next_installs_pytest_if_need_be(is_there, package, capsys, monkeypatch):
    name = "idlc.cli.run.scaffold.find_spec"
    monkeypatch.setattr(name, lambda name: object() if is_there or name != "pytest" else None)
    assert main(NODE) == 0
    hints = re.findall("next: .* -m (.*)", capsys.readouterr().out)
    assert hints == [*(() if is_there else ["pip install pytest"]), "pytest test/test_talker.py"]


def test_only_what_is_spelled_out_is_imported(package):
    words = ["--subscriber", "geometry_msgs/PoseStamped:pose"]
    assert main(["scaffold", "node", "listener", *words]) == 0
    text = (package / "demo/listener.py").read_text()
    assert "from geometry_msgs.msg import PoseStamped\n" in text
    assert "Quaternion" not in text


def test_a_file_that_is_no_text_is_not_called_missing(package, capsys):
    (package / "setup.cfg").unlink()
    setup = package / "setup.py"
    setup.write_bytes("# é\n".encode("latin-1") + setup.read_bytes())
    assert main(NODE) == 1
    assert re.findall(r"\[(IDL\d+)\]", capsys.readouterr().err) == ["IDL603"]


def test_tabs_stay_tabs(package):
    setup = package / "setup.py"
    setup.write_text(re.sub("(?m)^(    )+", lambda m: "\t" * (len(m[0]) // 4), setup.read_text()))
    assert main(NODE) == 0
    assert not re.search(r"(?m)^\s* ", setup.read_text().replace("    from", "\tfrom"))
