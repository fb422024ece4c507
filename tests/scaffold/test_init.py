"""`idlc init` sets up what people have, proves it, and changes nothing the second time."""

import json
import os
import re
import shutil
import sys
import venv
from importlib.util import find_spec
from pathlib import Path

import msgspec
import pytest
import yaml

from idlc.cli.main import main
from idlc.project.settings import toml
from idlc.scaffold.proof import Proof, missing_tool, prove
from tests.support.files import write, write_all
from tests.support.paths import DOCS, ROOT
from tests.support.programs import ended, run
from tests.support.projects import (
    INTERFACES,
    LIBRARY,
    MESSAGE,
    SAMPLES,
    SERVICE,
    SETUP,
    TUTORIAL,
    WORKSPACE,
    ament,
    backend,
    library,
)
from tests.support.repositories import git

BIN = Path(sys.executable).parent


@pytest.fixture
def project(here, monkeypatch):
    """The working folder, `project`, with idlc on PATH."""
    monkeypatch.setenv("PATH", f"{BIN}{os.pathsep}{os.environ['PATH']}")
    folder = here / "project"
    folder.mkdir()
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def unproved(monkeypatch):
    """Skip the proof, which takes seconds, where it has nothing to do with the tested files."""
    monkeypatch.setattr("idlc.cli.run.init.prove", lambda *_: Proof(""))
    monkeypatch.setattr("idlc.cli.run.init.installed_files", lambda *_: frozenset())


def tree(folder):
    """Return the content of every file but what was compiled by Python."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path: path.read_bytes() for path in files if "__pycache__" not in path.parts}


def follow(printed, cwd):
    """Run each command that was printed, as it stands; return what they print."""
    commands = re.findall(r"(?:^|; )next: (.+)", printed, re.MULTILINE)
    assert commands
    replies = []
    for number, command in enumerate(commands):
        script = " && ".join([*(c for c in commands[:number] if c.startswith("cd ")), command])
        status, reply = ended("sh", "-c", script, cwd=cwd)
        assert status == 0, f"{script}: {reply}"
        replies.append(reply)
    return "".join(replies)


#: A problem with its place, lines to paste, and hint.
PROBLEM = re.compile(
    r"^\w+\[(IDL\d+)\]: .*\n +--> ([^:\n]+)(?::(\d+):\d+)?\n((?:[ \d].*\n)*?) += hint: (.+)$",
    re.MULTILINE,
)


def follow_hints(printed, cwd):
    """Do what each hint says: run its commands, write its lines, or put its word in place."""
    for code, path, number, shown, hint in PROBLEM.findall(printed):
        quoted = re.findall("`([^`]+)`", hint)
        commands = [text for text in quoted if re.match("(idlc|cd|mkdir) ", text)]
        file = cwd / path
        lines = file.read_text().splitlines() if file.is_file() else []
        pasted = [line[4:] for line in re.findall(r"^ +\| .*$", shown, re.MULTILINE)]
        if commands and "idlc init" not in commands:
            run("sh", "-c", " && ".join(commands), cwd=cwd)
        elif hint.endswith("--fix does"):
            run("idlc", "check", "--fix", cwd=cwd)
        elif number and hint.startswith("add "):
            at = next(n for n, line in enumerate(lines) if n + 1 >= int(number) and line == ")")
            file.write_text("\n".join([*lines[: at + 1], quoted[0], *lines[at + 1 :], ""]))
        elif number and hint.startswith("did you mean "):
            old = lines[int(number) - 1].split()[0]
            file.write_text(file.read_text().replace(old, quoted[0]))
        elif hint.startswith(("add these lines by hand to its end", "add these lines to")):
            lines = [re.sub(r"^tool = \{ (.*) \}$", r"[tool]\n\1\n", line) for line in lines]
            file.write_text("\n".join([*sorted(lines, key="[tool]".__eq__), *pasted, ""]))
        elif hint.startswith("move it next to this one, or write"):
            file = cwd / "pyproject.toml"
            file.write_text(f"[tool.idlc]\n{quoted[0]}\n")
        elif "to the arguments of each" in hint:
            file.write_text(file.read_text().replace("setup(", f"setup({pasted[0]}"))
        else:
            pytest.fail(f"nobody can follow the hint of {code}: {hint}")


@pytest.mark.parametrize("name", SAMPLES)
def test_every_kind_of_package_is_set_up_once(name, project, monkeypatch, capsys):
    sample = SAMPLES[name]
    write_all(sample.files)
    before = tree(project)
    assert main(["init"]) == 1, "not without a terminal"
    printed = capsys.readouterr().out
    assert sample.words in printed
    # other tools run something that stops a build of outdated classes, or compile the interfaces
    is_unnoticed = any(f"(built with {tool})" in printed for tool in ("flit", "poetry", "uv"))
    assert ("run `idlc gen --check` before you build" in printed) == is_unnoticed
    assert tree(project) == before
    warning = r"The test runs the package's own build\."
    assert re.search(rf"{warning}\nnothing was written; next: idlc init --yes\n$", printed)
    assert main(["init", "--yes"]) == 0
    printed, problems = capsys.readouterr()
    assert "problem" not in problems
    assert re.search(r"^test passed: .* 1? ?\w* ?class", printed, re.MULTILINE)
    assert "next: idlc gen\n" in printed
    after = tree(project)
    monkeypatch.setattr("idlc.cli.run.init.prove", lambda *_: Proof(""))
    assert main(["init", "--yes"]) == 0
    assert "nothing to do\n" in capsys.readouterr().out
    assert tree(project) == after
    replies = follow(printed, project)
    assert {p: d for p, d in tree(project).items() if ".idlc" not in p.name} == after
    follow_hints(printed + problems + replies, project)
    assert main(["check", "--strict"]) == 0, capsys.readouterr().out
    assert main(["fmt", "--check"]) == 0


@pytest.mark.usefixtures("unproved")
def test_a_repository_compares_with_its_branch(project, capsys):
    write_all(ament())
    for words in (["init", "-q"], ["add", "-A"]):
        run("git", *words, cwd=project)
    who = ("-c", "user.name=A", "-c", "user.email=a@b.c")
    run("git", *who, "commit", "-qm", "start", cwd=project)
    assert main(["init", "--yes"]) == 0
    printed = capsys.readouterr().out
    assert printed.endswith("next: idlc check\nnext: idlc gen\nnext: idlc breaking\n")
    follow(printed, project)


@pytest.mark.parametrize("name", ["ament: src", "ament: declared", "hatchling: message"])
def test_hints_work_in_the_folder_as_they_stand(name, project, capsys):
    write_all(SAMPLES[name].files)
    assert main(["init", "--yes"]) == 0
    (path,) = project.rglob("*.msg")
    path.write_text("float32  later# [s]\n")
    hints = set()
    for words in (["check"], ["gen", "--check"], ["fmt", "--check"], ["breaking"]):
        main(words)
        hints.update(re.findall(r"`(idlc [^`]+)`", "".join(capsys.readouterr())))
    assert hints
    for hint in sorted(hints, key=lambda hint: "gen" in hint):
        run("sh", "-c", hint, cwd=project)
    run("idlc", "fmt", cwd=project)
    run("idlc", "gen", cwd=project)
    for words in (["check", "--strict"], ["gen", "--check"], ["fmt", "--check"]):
        assert main(words) == 0, capsys.readouterr().out


def test_a_new_kind_of_interface_is_added(project, capsys):
    write_all(SAMPLES["ament: tutorial"].files)
    assert main(["init", "--yes"]) == 0
    before = tree(project)
    write("action/Go.action", "---\n---\n")
    capsys.readouterr()
    assert main(["init", "--yes"]) == 0
    printed = capsys.readouterr().out
    assert "+        ('share/bot/action', glob('action/*.action')),\n" in printed
    assert "+  <depend>action_msgs</depend>\n" in printed
    changed = {path.name for path, data in tree(project).items() if before.get(path, data) != data}
    assert changed == {"setup.py", "package.xml", "bot", "idlc.lock", "_type_data.py"}
    follow(printed, project)


def test_what_is_not_installed_here_is_not_proved(project, capsys):
    write_all(ament() | {"msg/Depth.msg": "stereo_msgs/DisparityImage image\n"})
    assert main(["init", "--yes"]) == 0
    printed, problems = capsys.readouterr()
    reported = "`bot` imports `stereo_msgs`, which this Python cannot import" in problems
    assert reported == bool(find_spec("rclpy")), "it is reported where nodes run"
    name = "a package" if reported else "`stereo_msgs`"
    why = f"not tested: the import, because the classes import {name}, which is not installed\n"
    assert why in printed
    is_installed = "test passed: install a copy with pip\n" in printed
    assert is_installed == (not missing_tool("setuptools.build_meta"))
    assert "+  <depend>stereo_msgs</depend>\n" in printed
    follow(printed, project)


def test_a_workspace_is_a_table_of_packages(project, capsys):
    write_all(WORKSPACE)
    assert main(["init", "--yes"]) == 0
    printed = capsys.readouterr().out
    assert "this is a workspace of 3 packages\n" in printed
    assert "src/bot: bot is an ament_python package with 1 interface\n" in printed
    assert "src/tools: skipped, because it has no interfaces\n" in printed
    assert not Path("src/tools/pyproject.toml").exists()
    assert len(re.findall(r"^src/\w+: test passed", printed, re.MULTILINE)) == 2
    follow(printed, project)
    after = tree(project)
    assert main(["init", "--yes"]) == 0
    assert "nothing to do" in capsys.readouterr().out
    assert tree(project) == after


def test_another_folder_is_named(project, monkeypatch, capsys):
    write_all({f"a b/{path}": text for path, text in ament().items()})
    assert main(["init", "a b", "--yes"]) == 0
    printed = capsys.readouterr().out
    assert "next: cd 'a b'\n" in printed
    follow(printed, project)


SETUPTOOLS = LIBRARY + backend("setuptools>=61", "setuptools.build_meta")
FLAT = library(SETUPTOOLS, "track_kit")
#: Folders that are refused, and a part of the sentence.
REFUSED = {
    "syntax": (
        ament(SETUP.replace("=find_packages(", "=(find_packages(")),
        "cannot edit `setup.py`: '(' was never closed\n --> setup.py:5:6\n",
    ),
    "no call": (ament("print('nothing to install')\n"), "there are no calls of setup()"),
    "two calls": (
        ament(
            "from setuptools import setup\nif 1:\n    setup(name='bot', packages=['bot'])\n"
            "else:\n    setup(name='b')\n"
        ),
        "there are 2 calls of setup()\n --> setup.py\n  |\n  | idlc_interfaces=True,\n",
    ),
    "xml": (ament(**{"package.xml": "<package"}), "--> package.xml:1:1"),
    "name": (
        ament(**{"package.xml": "<package><name>../x</name></package>"}),
        "`../x` is not a package name",
    ),
    "build type": (
        ament(**{"package.xml": "<package><name>bot</name></package>"}),
        "`bot` is a package without a build type",
    ),
    "toml": ({"pyproject.toml": "[project\n"}, "not valid TOML: expected ']'"),
    "inline table": (
        library(f"tool = {{ x = 1 }}\n{SETUPTOOLS}"),
        '| [tool.idlc]\n  | paths = ["interfaces"]\n  | out = "src/track_kit/ros"\n',
    ),
    "several": (
        {**FLAT, "other/__init__.py": "", "pyproject.toml": SETUPTOOLS.replace("track", "x")},
        "`.` contains several Python packages (`other`, `track_kit`)",
    ),
    "no library": ({"pyproject.toml": SETUPTOOLS}, "has no Python package"),
    "backend": (
        library(LIBRARY + backend("idlc", "idlc.backend")),
        "`idlc.backend` builds ROS 2 packages, but there is no package.xml",
    ),
    "module in the way": (
        ament(**{"bot/msg.py": "A = 1\n"}) | MESSAGE,
        "`bot/msg.py` already exists, but idlc generates the module `bot.msg`",
    ),
    "classes in the way": (
        ament(**{"bot/srv/__init__.py": "class Water: ...\n"}) | SERVICE,
        "`bot/srv/__init__.py` already exists, but idlc generates the module `bot.srv`",
    ),
    "keyword": (
        {"pyproject.toml": SETUPTOOLS, "src/class/__init__.py": ""},
        "has no Python package",
    ),
    "other files": ({"notes.txt": ""}, "idlc scaffold package my_robot"),
    "nesting": (ament(f"{SETUP}x = {'-' * 100_000}1\n"), "`setup.py`: it is nested too deeply"),
    "outside": (
        library(f'{SETUPTOOLS}[tool.idlc]\npaths = ["."]\nout = "../x"\n'),
        "the folder for the classes is outside this folder: `../x`",
    ),
    "interfaces outside": (
        library(f'{SETUPTOOLS}[tool.idlc]\npaths = ["../x"]\nout = "a"\n'),
        "no .msg, .srv or .action file in `../x`",
    ),
    "URL": (
        library(f'{SETUPTOOLS}[tool.idlc]\npaths = ["https://a/b"]\nout = "a"\n'),
        "`paths` in [tool.idlc] is a URL",
    ),
    "byte order mark": (
        ament(**{"pyproject.toml": "\ufeff[tool.ruff]\n"}),
        "without a byte order mark",
    ),
    "no text": (ament(SETUP + "# \udce9\n"), "byte 0xE9 is not UTF-8"),
    "duplicate": (ament() | {"msg/A.msg": "", "a/msg/A.msg": ""}, "error[IDL609]"),
    "package in a package": (
        ament()
        | MESSAGE
        | {f"sub/{path}": text.replace("bot", "sub") for path, text in (ament() | MESSAGE).items()},
        "`sub` in this folder is another package\n --> sub\n",
    ),
    "interface": (ament() | {"msg/A.msg": "flot32 a\n"}, "did you mean `float32`?"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_an_unclear_folder_is_refused(name, project, capsys):
    files, sentence = REFUSED[name]
    write_all(
        {path: text for path, text in files.items() if not re.search("[\udc80-\udcff]", text)}
    )
    for path in files.keys() - {path.relative_to(project).as_posix() for path in tree(project)}:
        Path(path).write_bytes(files[path].encode(errors="surrogateescape"))
    before = tree(project)
    assert main(["init", "--yes"]) in (1, 2)
    problems = capsys.readouterr().err
    assert sentence in problems
    assert problems.endswith("nothing was written\n")
    assert len(re.findall("^error", problems, re.MULTILINE)) == 1
    assert tree(project) == before


def test_a_folder_whose_name_has_no_letter_for_a_package_is_named(project, monkeypatch, capsys):
    folder = project / "日本"
    folder.mkdir()
    monkeypatch.chdir(folder)
    assert main(["init", "--yes"]) == 2
    assert "is not a valid package name: `日本` is not" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["setup.py", ".gitattributes", "pyproject.toml"])
def test_a_pipe_in_the_way_is_named_before_anything_is_written(name, project, capsys):
    files = ament()
    files.pop(name, None)
    write_all(files)
    before = tree(project)
    os.mkfifo(name)
    assert main(["init"]) == 1
    printed, problems = capsys.readouterr()
    assert f"`{name}` is a named pipe" in problems
    assert "next:" not in printed
    assert tree(project) == before


@pytest.mark.parametrize("name", ["setup.py", "package.xml", "pyproject.toml", "msg", "resource"])
def test_a_link_is_not_written_through(name, project, capsys):
    write_all(ament() | {"pyproject.toml": "[tool.ruff]\n", "bot/msg/.keep": "", "msg/.keep": ""})
    outside = project.parent / "outside"
    (project / name).rename(outside)
    (project / name).symlink_to(outside)
    before = outside.read_bytes() if outside.is_file() else tree(outside)
    assert main(["init", "--yes"]) == 1
    assert f"`{name}` is a symbolic link" in capsys.readouterr().err
    assert before == (outside.read_bytes() if outside.is_file() else tree(outside))


@pytest.mark.parametrize("path", ["bot", "src/track_kit"])
def test_no_class_is_written_through_a_link(path, project, capsys):
    write_all(ament() if path == "bot" else library(SETUPTOOLS))
    outside = project.parent / "outside"
    (project / path).rename(outside)
    (project / path).symlink_to(outside)
    before = tree(project.parent)
    assert main(["init", "--yes"]) == 2
    assert f"the folder for the classes is outside this folder: `{path}" in capsys.readouterr().err
    assert tree(project.parent) == before


def test_a_package_outside_of_a_workspace_is_left_alone(project, capsys):
    write_all(WORKSPACE)
    outside = project.parent / "outside"
    Path("src/bot").rename(outside)
    Path("src/bot").symlink_to(outside)
    before = tree(outside)
    assert main(["init", "--yes"]) == 0
    assert "src/bot: skipped, because it is outside this folder\n" in capsys.readouterr().out
    assert tree(outside) == before


def test_a_folder_may_have_the_name_of_an_option(project, capsys):
    write_all({f"-x/{path}": text for path, text in ament().items()})
    assert main(["init", "--yes", "--", "-x"]) == 0
    printed = capsys.readouterr().out
    assert "next: cd ./-x\n" in printed
    follow(printed, project)


@pytest.mark.parametrize(
    ("settings", "is_named"),
    [
        ("", False),
        ('[tool.other]\nname = "else"\n', False),
        ('[project]\nname = "bot"\nversion = "1.2"\n', True),
    ],
    ids=["empty", "another table", "named"],
)
@pytest.mark.usefixtures("unproved")
def test_a_setup_py_that_is_missing_names_the_package(settings, is_named, project):
    files = {**ament(), "pyproject.toml": settings}
    del files["setup.py"]
    write_all(files)
    assert main(["init", "--yes"]) == 0
    text = Path("setup.py").read_text()
    assert ("name=" in text) is not is_named
    assert "('share/ament_index/resource_index/packages', ['resource/bot'])" in text
    assert run(sys.executable, "setup.py", "--name", cwd=project).splitlines()[-1] == "bot"


#: The refusals whose hint is a command or names what to write.
FOLLOWED = [
    "backend",
    "no call",
    "two calls",
    "build type",
    "inline table",
    "several",
    "other files",
    "package in a package",
    "interface",
]


@pytest.mark.parametrize("name", FOLLOWED)
def test_the_hint_of_a_refusal_works_as_it_stands(name, project, capsys):
    write_all(REFUSED[name][0] | ({} if name == "interface" else MESSAGE))
    assert main(["init", "--yes"]) in (1, 2)
    follow_hints(capsys.readouterr().err, project)
    if name == "build type":
        assert Path("build/bot/msg/_level.py").is_file()
    elif name == "backend":
        assert main(["check", "my_msgs"]) == 0
    elif name == "other files":
        assert main(["check", "my_robot"]) == 0
    else:
        # setuptools finds no packages in a folder with several, whether or not idlc is there
        status = 1 if name == "several" else 0
        assert main(["init", "--yes"]) == status, capsys.readouterr()


@pytest.mark.parametrize(
    ("new", "shown"),
    [
        ("packages=choose()", "packages=find_packages(exclude=['test', 'test.*'])"),
        ("**arguments()", "packages=find_packages(exclude=['test', 'test.*'])"),
    ],
)
def test_a_computed_value_is_named_and_not_run(new, shown, project, capsys):
    text = TUTORIAL.replace("packages=[package_name]", new)
    functions = (
        "def choose():\n    return ['bot']\ndef arguments():\n    return {'packages': ['bot']}\n"
    )
    write_all(ament(f"open('ran', 'w')\n{functions}{text}"))
    assert main(["init"]) == 1
    assert main(["gen"]) == 2, "there is no interface yet"
    assert not Path("ran").exists()
    printed = capsys.readouterr().out
    assert shown in printed
    assert f"\n {'    ' + new},\n" in printed, "the line stays"
    assert main(["init", "--yes"]) == 0


@pytest.mark.parametrize(
    ("old", "new"), [("    ", "\t"), ("\n", "\r\n"), ("from setuptools", "\ufefffrom setuptools")]
)
def test_the_layout_of_files_stays(old, new, project, capsys):
    write_all(ament(TUTORIAL))
    for name in ("setup.py", "package.xml"):
        text = Path(name).read_text().replace(old, new)
        Path(name).write_bytes(text.encode())
    lines = Path("setup.py").read_bytes().splitlines(keepends=True)
    assert main(["init", "--yes"]) == 0
    after = Path("setup.py").read_bytes().splitlines(keepends=True)
    assert {*lines[2:]} - {*after} == {line for line in lines if b"packages=" in line}
    assert {line.endswith(b"\r\n") for line in after} == {new == "\r\n"}
    capsys.readouterr()
    assert main(["init"]) == 0
    assert "nothing to do" in capsys.readouterr().out


@pytest.mark.usefixtures("unproved")
def test_a_setting_that_exists_stays(project):
    write_all(library(f'{SETUPTOOLS}\n[tool.idlc]\npaths = ["a b"]\npackage = "mine"\n'))
    assert main(["init", "--yes"]) == 0
    assert Path("a b/msg/Example.msg").is_file()
    text = Path("pyproject.toml").read_text()
    table = '[tool.idlc]\nout = "src/track_kit/ros"\nvendor-deps = true\npaths = ["a b"]\n'
    assert text.endswith(f'{table}package = "mine"\n')


@pytest.mark.usefixtures("unproved")
def test_a_package_that_is_excluded_is_not_the_librarys(project, capsys):
    write_all({f"ros/{path}": text for path, text in INTERFACES.items()})
    write_all(library(f'{SETUPTOOLS}\n[tool.idlc]\nexclude = ["ros"]\n'))
    assert main(["init", "--yes"]) == 0
    assert "with no interfaces yet\n" in capsys.readouterr().out
    assert Path("src/track_kit/ros/msg/_example.py").is_file()
    assert not [*Path("src").rglob("*field*")]


@pytest.mark.usefixtures("unproved")
def test_settings_of_a_folder_above_are_not_the_librarys(project, monkeypatch):
    write("pyproject.toml", '[tool.idlc]\npaths = ["x"]\nout = "y"\n')
    write_all({f"lib/{path}": text for path, text in SAMPLES["setuptools: setup.py"].files.items()})
    monkeypatch.chdir("lib")
    assert main(["init", "--yes"]) == 0
    assert Path("track_kit/ros/msg/__init__.py").is_file()


@pytest.mark.usefixtures("unproved")
def test_a_library_without_an_init_py_says_where_its_classes_are(project):
    table = '\n[tool.idlc]\nout = "src/ada/kit/ros"\n'
    write_all({"pyproject.toml": SETUPTOOLS + table, "src/ada/kit/track.py": ""})
    assert main(["init", "--yes"]) == 0
    assert 'package = "track_kit_msgs"' in Path("pyproject.toml").read_text()
    assert Path("src/ada/kit/ros/msg/_example.py").is_file()


def test_a_library_without_py_typed_is_told_what_its_users_need(project, unproved, capsys):
    write_all(library(SETUPTOOLS))
    Path("src/track_kit/py.typed").unlink()
    assert main(["init", "--yes"]) == 0
    (command,) = re.findall("note: type checkers .*`(.*)`", capsys.readouterr().out)
    run("sh", "-c", command, cwd=project)
    shutil.rmtree("src/track_kit/ros")
    assert main(["init", "--yes"]) == 0
    assert "note: type checkers" not in capsys.readouterr().out


def test_a_package_for_both_versions_of_ros_is_one_of_ros_2(project, capsys):
    old = "<build_type>ament_python"
    new = f'<build_type condition="$ROS_VERSION == 1">catkin</build_type>\n    {old}'
    write_all(ament())
    write("package.xml", Path("package.xml").read_text().replace(old, new))
    assert main(["init", "--yes"]) == 0
    assert "bot is an ament_python package" in capsys.readouterr().out


@pytest.mark.usefixtures("project")
def test_classes_that_need_an_absent_numpy_are_not_tested(tmp_path):
    write("kit/__init__.py", "")
    write("kit/msg.py", "raise ModuleNotFoundError(\"No module named 'numpy'\")\n")
    proof = prove(tmp_path, "", ("kit.msg.A",), Path.cwd())
    assert (proof.tried, proof.failure) == ("", "")
    assert proof.obstacle.startswith("the import, because `numpy` is missing")


def test_an_authors_own_tools_stay_green(project, unproved):
    """Linters and type checkers without settings report nothing in what idlc writes."""
    fields = "std_msgs/Header header\nfloat32[] ranges\nuint8[3] colour\n"
    for name, files in (("library", library(SETUPTOOLS)), ("ament", ament())):
        folder = project / name
        folder.mkdir()
        os.chdir(folder)
        write_all({**files, ("interfaces/" * (name == "library") + "msg/A.msg"): fields})
        assert main(["init", "--yes"]) == 0
        theirs = ("setup.py", "talker.py") if name == "ament" else ()
        own = [word for path in theirs for word in ("--exclude", path)]
        (copy,) = folder.rglob("_idlc/arrays.py")
        assert "# pyright: reportMissingImports=false\n" in copy.read_text(encoding="utf-8")
        for words in (
            ("ruff", "check", "--isolated", "--no-cache", ".", *own),
            ("ruff", "format", "--isolated", "--no-cache", "--check", ".", *own),
            # as where neither numpy nor ROS 2 is installed
            (
                "mypy",
                "--no-site-packages",
                "--strict",
                "--exclude",
                f"({'|'.join((*theirs, 'test_flake8.py'))})$",
                ".",
            ),
        ):
            status, printed = ended(sys.executable, "-m", *words, cwd=folder)
            assert status == 0, f"{name}: {printed}"


def test_settings_join_the_table_that_exists(project, capsys):
    text = f"{SETUPTOOLS}\n[tool.idlc]  # ours\ndistro = 'jazzy'\n\n[tool.ruff]\nline-length = 99"
    write_all(library(text))
    assert main(["init", "--yes"]) == 0
    table = '[tool.idlc]  # ours\npaths = ["interfaces"]\nout = "src/track_kit/ros"\n'
    assert table in Path("pyproject.toml").read_text()
    assert Path("pyproject.toml").read_text().endswith("\n[tool.ruff]\nline-length = 99\n")


@pytest.mark.parametrize(
    ("table", "folder"),
    [('\n[tool.setuptools]\npackages = ["track_kit"]\n', "track_kit"), ("", "data")],
)
def test_setuptools_is_told_of_the_classes_by_the_hint(table, folder, project, capsys):
    files = {**FLAT, "pyproject.toml": SETUPTOOLS + table, "interfaces/msg/A.msg": "bool a\n"}
    write_all({**files, f"{folder}/a.txt": ""})
    assert main(["init", "--yes"]) == 1
    printed = capsys.readouterr()
    assert "not tested, because the build omits the classes (see above)\n" in printed.out
    hint = re.search(r"write `(.*)` in (\[.*\])", printed.err)
    text = Path("pyproject.toml").read_text().replace('packages = ["track_kit"]', hint[1])
    write("pyproject.toml", text if table else f"{text}\n{hint[2]}\n{hint[1]}\n")
    words = ["-c", "from setuptools import setup; setup()", "-q", "build", "--build-lib=lib"]
    run(sys.executable, *words, cwd=project)
    assert [path.name for path in Path("lib").iterdir()] == ["track_kit"]
    assert Path("lib/track_kit/ros/_idlc/__init__.py").is_file()


def test_names_from_files_are_shown_without_harm(project, capsys):
    evil = LIBRARY + backend("x", "os\\u001b[31m.evil")
    write_all(library(evil) | {"src/track_kit/a\x1b[31m.msg": "bool a\n"})
    main(["init", "--yes"])
    assert "\x1b" not in "".join(capsys.readouterr())


def test_it_asks_once_on_a_terminal(project):
    write_all(ament())
    for answer, is_written in (("n", False), ("edit", False), ("y", True)):
        talk = f"""if True:
            import os, pty, sys
            os.environ["TERM"] = "dumb"
            pid, end = pty.fork()
            if not pid:
                os.execv({sys.executable!r}, [{sys.executable!r}, "-m", "idlc", "init"])
            text = b""
            while chunk := b"" if b"[y/N]: " in text else os.read(end, 4096):
                text += chunk
            {"open('setup.py', 'a').write('# mine')" if answer == "edit" else "pass"}
            os.write(end, b"{answer[-1] if answer == "n" else "y"}\\n")
            try:
                while chunk := os.read(end, 4096):
                    text += chunk
            except OSError:
                pass
            print(text.decode(), os.waitpid(pid, 0)[1])
        """
        said = run(sys.executable, "-c", talk, cwd=project)
        assert said.count("The test runs the package's own build. [y/N]: ") == 1
        assert Path("bot/msg").exists() == is_written, said
        assert ("`setup.py` was changed while idlc was running" in said) == (answer == "edit")
        assert Path("setup.py").read_text().endswith("# mine") == (answer != "n")


@pytest.mark.parametrize(
    ("service", "after", "path"),
    [
        ("github", "## GitHub", ".github/workflows/interfaces.yml"),
        ("gitlab", "## GitLab", ".gitlab-ci.yml"),
        ("pre-commit", "## pre-commit", ".pre-commit-config.yaml"),
    ],
)
@pytest.mark.usefixtures("unproved")
def test_a_service_gets_the_file_of_the_documents(service, after, path, project, capsys):
    write_all({f"bot/{name}": text for name, text in ament().items()})
    run("git", "init", "-q", cwd=project / "bot")
    assert main(["init", "bot", "--ci", service]) == 1
    assert f"next: idlc init bot --ci {service} --yes\n" in capsys.readouterr().out
    assert main(["init", "bot", "--ci", service, "--yes"]) == 0
    page = (DOCS / "ci.md").read_text(encoding="utf-8")
    block = re.findall(r"(?ms)^```yaml\n(.*?)^```$", page[page.index(after) :])[0]
    assert (project / "bot" / path).read_text() == block.replace("          paths: src\n", "")
    before = tree(project)
    assert main(["init", "bot", "--ci", service, "--yes"]) == 0
    assert "nothing to do" in capsys.readouterr().out
    (project / "bot" / path).write_text("jobs: {}\n")
    before[project / "bot" / path] = b"jobs: {}\n"
    assert main(["init", "bot", "--ci", service, "--yes"]) == 1
    assert "add the missing lines" in capsys.readouterr().err
    assert tree(project) == before


@pytest.mark.usefixtures("unproved")
def test_a_service_gets_the_idlc_that_it_runs(project, capsys):
    """A workflow needs idlc in the repository; pre-commit needs a fixed commit of a clone."""
    (block,) = re.findall(r"(?ms)^```sh\n(python3 -I.*?)^```$", (DOCS / "ci.md").read_text())
    wheel, action, ignored, added = block.splitlines()
    git("init", "-q")
    git("init", "-q", "../idlc")
    git("commit", "-q", "--allow-empty", "-m", "one", cwd="../idlc")
    write_all(SAMPLES["ament_cmake"].files)
    expected = {
        "github": [wheel, action, ignored, added],
        "gitlab": [wheel, added.removesuffix(" tools/idlc")],
        "pre-commit": [],
    }
    for service, commands in expected.items():
        assert main(["init", "--ci", service, "--yes"]) == 0
        lines = capsys.readouterr().out.splitlines()
        shown = [line.removeprefix("next: ") for line in lines if line.startswith("next: ")]
        assert shown[:-2] == commands  # the last two are commands of idlc
    settings = yaml.safe_load((project / ".pre-commit-config.yaml").read_text())
    commit = git("rev-parse", "HEAD", cwd="../idlc").decode().strip()
    assert settings["repos"][0]["rev"] == commit
    git("commit", "-q", "--allow-empty", "-m", "two", cwd="../idlc")
    assert main(["init", "--ci", "pre-commit", "--yes"]) == 0
    assert "nothing to do" in capsys.readouterr().out


@pytest.mark.parametrize("service", ["github", "gitlab", "pre-commit"])
@pytest.mark.usefixtures("unproved")
def test_a_service_looks_for_no_code_that_is_not_committed(service, project):
    write_all(SAMPLES["ament_cmake"].files)
    assert main(["init", "--ci", service, "--yes"]) == 0
    (path,) = [path for path in project.rglob("*") if path.suffix in (".yml", ".yaml")]
    text = path.read_text()
    assert "idlc gen" not in text
    assert "id: idlc-gen" not in text
    assert ('generated: "false"' in text) == (service == "github")
    assert yaml.safe_load(text)


@pytest.mark.parametrize(
    ("file", "old", "new", "obstacle"),
    [
        ("package.xml", "<build_type>ament_cmake</build_type>", "", "has no `<build_type>`"),
        ("CMakeLists.txt", "rosidl_generate_interfaces", "message", "installs no interface"),
        ("CMakeLists.txt", "ament_package()", "add_library(field_msgs a.cpp)", "two targets"),
    ],
)
def test_an_obstacle_to_the_build_is_reported(file, old, new, obstacle, project, capsys):
    write_all(SAMPLES["ament_cmake"].files)
    path = project / file
    path.write_text(path.read_text().replace(old, new))
    assert main(["init"]) == 1  # the changes are shown
    assert obstacle in capsys.readouterr().err


@pytest.fixture(scope="module")
def python(tmp_path_factory):
    """Python in an environment with the tools that build packages, which can import idlc."""
    folder = tmp_path_factory.mktemp("tools") / "venv"
    venv.create(folder, with_pip=True)
    tools = ["setuptools", "wheel", "hatchling", "flit_core", "poetry-core", "pdm-backend"]
    program = folder / "bin" / "python"
    run(program, "-m", "pip", "install", "-q", *tools, "uv_build", cwd=folder)
    (site,) = folder.glob("lib/python3*/site-packages")
    own = (ROOT, Path(msgspec.__file__).parents[1])
    (site / "idlc.pth").write_text("".join(f"{path}\n" for path in own))
    return program


INSTALL = ("-m", "pip", "install", "-q", "--no-deps", "--no-index", "--no-build-isolation")
CLASS = "import sys; sys.path.insert(0, sys.argv[1]); from {} import {}; print({}.__module__)"


@pytest.mark.long
@pytest.mark.parametrize(
    "name", ["ament: pyproject", *(name for name in SAMPLES if not name.startswith("ament"))]
)
def test_an_installed_package_is_imported_elsewhere(name, project, python, tmp_path, monkeypatch):
    sample = SAMPLES[name]
    monkeypatch.setenv("PATH", f"{python.parent}{os.pathsep}{os.environ['PATH']}")
    write_all(sample.files)
    said = run(python, "-m", "idlc", "init", "--yes", cwd=project)
    assert "test passed: install a copy with pip, and import" in said
    run(
        python,
        *INSTALL,
        "--target",
        tmp_path / "site",
        shutil.copytree(".", tmp_path / "copy"),
        cwd=tmp_path,
    )
    code = CLASS.format(sample.module, sample.name, sample.name)
    said = run(python, "-I", "-c", code, tmp_path / "site", cwd=tmp_path)
    assert said.startswith(sample.module)
    assert "nothing to do" in run(python, "-m", "idlc", "init", "--yes", cwd=project)


@pytest.mark.long
@pytest.mark.ros  # colcon is installed with what needs ROS 2
@pytest.mark.parametrize("name", [name for name in SAMPLES if name.startswith("ament: ")])
@pytest.mark.usefixtures("unproved")
def test_colcon_builds_what_was_set_up(name, project, tmp_path):
    sample = SAMPLES[name]
    write_all({f"src/{path}": text for path, text in sample.files.items()})
    assert main(["init", "src", "--yes"]) == 0
    before = tree(project / "src")
    run(BIN / "colcon", "--log-base", tmp_path / "log", "build", cwd=project)
    assert tree(project / "src") == before
    (site,) = Path("install/bot").glob("lib/python3*/site-packages")
    code = CLASS.format(sample.module, sample.name, sample.name)
    assert run(sys.executable, "-I", "-c", code, site, cwd=project).startswith("bot.")
    share = Path("install/bot/share")
    assert (share / f"bot/{sample.module[4:]}/{sample.name}.{sample.module[4:]}").is_file()
    assert (share / "ament_index/resource_index/rosidl_interfaces/bot").is_file()
    assert (share / "ament_index/resource_index/packages/bot").is_file()
    assert (share / "bot/package.xml").is_file()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("", '[project]\ndependencies = ["numpy"]\nname'),
        ("dependencies = []\n", 'dependencies = ["numpy",]\n'),
        ('dependencies = ["x"]\n', 'dependencies = ["numpy", "x"]\n'),
        ('dependencies = [\n    "x",\n]\n', 'dependencies = [\n    "numpy",\n    "x",\n]\n'),
        ('dependencies = ["numpy>=1"]\n', None),
        ('dynamic = ["dependencies"]\n', None),
    ],
)
@pytest.mark.usefixtures("unproved")
def test_a_library_with_arrays_depends_on_numpy(old, new, project, capsys):
    text = SETUPTOOLS.replace("requires-python", f"{old}requires-python")
    write_all(library(text) | {"interfaces/msg/Box.msg": "float64[3] size  # [m]\n"})
    assert main(["init", "--yes"]) == 0
    printed = capsys.readouterr().out
    assert (new or text) in Path("pyproject.toml").read_text()
    is_noted = "note: the classes have arrays, which need numpy: add it to the library's" in printed
    assert is_noted == ("dynamic" in old)
    assert main(["init"]) == 0
    assert "nothing to do" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (None, '{\n  "recommendations": ["idlc.idlc"]\n}\n'),
        ('{"recommendations": []}', '{"recommendations": ["idlc.idlc"]}'),
        (
            '{\n  "recommendations": [\n    "x.y" // z\n  ]\n}\n',
            '{\n  "recommendations": [\n    "idlc.idlc",\n    "x.y" // z\n  ]\n}\n',
        ),
        (
            '{"unwantedRecommendations": ["idlc.idlc"]}',
            '{"unwantedRecommendations": ["idlc.idlc"]}',
        ),
        ("// none\n{}\n", "// none\n{}\n"),
    ],
)
@pytest.mark.usefixtures("unproved")
def test_vs_code_recommends_the_extension_where_it_is_used(old, new, project, capsys):
    write_all(WORKSPACE)
    Path(".vscode").mkdir()
    if old is not None:
        write(".vscode/extensions.json", old)
    assert main(["init", "--yes"]) == 0
    assert Path(".vscode/extensions.json").read_text() == new
    package = json.loads((ROOT / "editors/vscode/package.json").read_text(encoding="utf-8"))
    assert f"{package['publisher']}.{package['name']}" == "idlc.idlc"
    capsys.readouterr()
    assert main(["init", "--yes"]) == 0
    assert "nothing to do" in capsys.readouterr().out


@pytest.mark.parametrize("path", [".", "a b"])
@pytest.mark.usefixtures("unproved")
def test_the_hint_on_an_edited_class_is_a_command(path, project, capsys):
    write_all({f"{path}/{name}": text for name, text in (ament() | MESSAGE).items()})
    assert main(["init", path, "--yes"]) == 0
    (Path(path) / "bot/msg/_level.py").write_text("# mine\n")
    write(f"{path}/msg/Level.msg", "float32 level  # [m]\n")
    capsys.readouterr()
    assert main(["init", path, "--yes"]) == 1
    (hint,) = re.findall(r"hint: .*`(.* --force)`", capsys.readouterr().err)
    run("sh", "-c", hint, cwd=project)
    assert "# mine" not in (Path(path) / "bot/msg/_level.py").read_text()
    assert main(["init", path, "--yes"]) == 0


@pytest.mark.usefixtures("unproved")
def test_gen_in_a_workspace_names_a_command_for_all_packages(project, capsys):
    write_all(WORKSPACE)
    assert main(["init", "--yes"]) == 0
    for name in ("src/bot/bot", "src/field_msgs/build"):
        shutil.rmtree(Path(name) / "msg", ignore_errors=True)
    shutil.rmtree("src/field_msgs/build")
    shutil.rmtree("src/bot/bot/srv")
    capsys.readouterr()
    assert main(["gen"]) == 2
    (command,) = re.findall(r"hint: run `(.*)`$", capsys.readouterr().err, re.MULTILINE)
    run("sh", "-c", command, cwd=project)
    assert Path("src/bot/bot/srv/__init__.py").is_file()
    assert Path("src/field_msgs/build/field_msgs/msg/__init__.py").is_file()


def of_ros(name, *depends, build="ament_cmake"):
    """Return the files of a package in a folder of its name, whose message uses others."""
    export = f"<export><build_type>{build}</build_type></export>"
    fields = "".join(f"{each}/A {each}\n" for each in depends)
    return {
        f"{name}/package.xml": f"<package><name>{name.rpartition('/')[2]}</name>{export}</package>",
        f"{name}/msg/A.msg": f"int8 a\n{fields}",
        f"{name}/CMakeLists.txt": "",
    }


#: Packages beside each other, and the `include` of some.
SIBLINGS = {
    "flat": (of_ros("b_msgs") | of_ros("a_msgs", "b_msgs"), {"a_msgs": ["../b_msgs"]}),
    "nested": (
        of_ros("x/c_msgs") | of_ros("b_msgs", "c_msgs") | of_ros("y/z/a_msgs", "b_msgs"),
        {"y/z/a_msgs": ["../../../b_msgs", "../../../x/c_msgs"], "b_msgs": ["../x/c_msgs"]},
    ),
    "of Python": (
        of_ros("b_msgs", build="ament_python")
        | of_ros("x/c", "b_msgs", build="ament_python")
        | of_ros("a_msgs", "c", build="ament_python"),
        {"a_msgs": ["../b_msgs", "../x/c"], "x/c": ["../../b_msgs"]},
    ),
    "standard": (of_ros("std_msgs") | of_ros("a_msgs", "std_msgs"), {"a_msgs": None}),
}


@pytest.mark.parametrize("case", SIBLINGS)
@pytest.mark.usefixtures("unproved")
def test_a_package_includes_those_beside_it_whose_messages_it_uses(
    case, project, monkeypatch, capsys
):
    files, includes = SIBLINGS[case]
    write_all({**files, ".git/HEAD": ""})
    main(["init", "--yes"])
    printed, problems = capsys.readouterr()
    assert f"this is a workspace of {len(files) // 3} packages\n" in printed
    assert ("nothing was written" in problems) == (case == "standard"), problems
    for folder, include in includes.items():
        path = Path(folder, "pyproject.toml")
        table = toml(path.read_text()) if path.exists() else {"tool": {"idlc": {}}}
        assert table["tool"]["idlc"].get("include") == include
        if include:  # beside the interfaces, there are classes by now
            monkeypatch.chdir(project / folder)
            assert main(["gen"]) == 0
            monkeypatch.chdir(project)


PROJECT = '[project]\nname = "kit"\nversion = "1"\n'
#: A root with a pyproject.toml, and what it is.
ROOTS = {
    "uv": ({"pyproject.toml": PROJECT}, "this is a workspace of 1 package\n"),
    "poetry": (
        {"pyproject.toml": '[tool.poetry]\nname = "x"\n'},
        "this is a workspace of 1 package",
    ),
    "a helper": (
        {"pyproject.toml": PROJECT, "kit/__init__.py": ""},
        "this is a workspace of 1 package\n",
    ),
    "a library": (
        {"pyproject.toml": PROJECT, "kit/__init__.py": "", "interfaces/msg/A.msg": ""},
        "kit is a Python library in kit",
    ),
}


@pytest.mark.parametrize("root", ROOTS)
@pytest.mark.usefixtures("unproved")
def test_a_folder_of_packages_is_a_workspace_whatever_its_root_lists(root, project, capsys):
    files, words = ROOTS[root]
    write_all({**files, **of_ros("a_msgs")})
    main(["init"])
    assert words in "".join(capsys.readouterr())


@pytest.mark.parametrize(
    ("settings", "is_noticed"),
    [
        ("", True),
        ("[tool.hatch.build.hooks.vcs]\nversion-file = 'v.py'\n", True),
        ("[tool.hatch.build.hooks.custom]\ndependencies = []\n", True),
        ("[tool.hatch.build.hooks.custom]\npath = 'own.py'\n", False),
        ("[tool.hatch.build.hooks]\ncustom.path = 'own.py'\n", False),
        ("[tool.hatch]\nbuild = { dev-mode-dirs = ['src'] }\n", False),
    ],
)
def test_a_build_that_runs_a_hook_of_its_own_is_noted(settings, is_noticed, project, capsys):
    system = '[build-system]\nrequires = ["hatchling"]\nbuild-backend = "hatchling.build"\n'
    text = f'[project]\nname = "bot"\nversion = "1"\n{system}{settings}'
    write_all({"bot/__init__.py": "", "pyproject.toml": text})
    assert main(["init"]) == 1, "not without a terminal"
    printed = capsys.readouterr().out
    assert ('+path = "bot/ros/_idlc_build.py"' in printed) == is_noticed
    assert ("run `idlc gen --check` before you build" in printed) != is_noticed


@pytest.mark.parametrize("tool", ["hatchling.build", "flit_core.buildapi", "poetry"])
@pytest.mark.usefixtures("unproved")
def test_a_package_of_another_backend_gets_no_setup_py(tool, project, capsys):
    text = f'[project]\nname = "bot"\nversion = "1"\n[build-system]\nbuild-backend = "{tool}"\n'
    text = '[tool.poetry]\nname = "bot"\n' if tool == "poetry" else text
    files = of_ros(".", build="ament_python") | {"bot/__init__.py": "", "pyproject.toml": text}
    write_all({**files, "package.xml": files["./package.xml"].replace("<name>.", "<name>bot")})
    Path("CMakeLists.txt").unlink()
    assert main(["init", "--yes"]) == 0
    printed = capsys.readouterr().out
    assert "builds the package, so idlc writes no setup.py" in printed
    assert not Path("setup.py").exists()
    assert Path("bot/msg/__init__.py").exists()
    assert main(["check", "--select", "package", "--ignore", "IDL453,IDL454"]) == 0
    assert "no problems" in capsys.readouterr().out
