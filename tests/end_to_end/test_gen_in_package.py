"""`idlc gen` knows the package around, and hints are commands that work as they stand."""

import re
import shlex
from pathlib import Path

import pytest

from idlc.cli.main import main
from tests.support.files import write_all

pytestmark = pytest.mark.usefixtures("here")

FILES = {
    "ws/bot/package.xml": '<package format="3">\n  <name>bot</name>\n  <export>'
    "<build_type>ament_python</build_type></export>\n</package>\n",
    "ws/bot/setup.py": "",
    "ws/bot/msg/A.msg": "bool a\n",
    "ws/bot/msg/B.msg": "bool a\n",
}


@pytest.mark.parametrize(
    ("place", "words"), [("ws/bot", []), ("ws/bot", ["."]), ("ws/bot/msg", []), ("ws", ["bot"])]
)
def test_a_package_is_compiled_into_the_folder_of_its_name(place, words, monkeypatch):
    write_all(FILES)
    home = Path("ws/bot").resolve()
    monkeypatch.chdir(place)
    assert main(["gen", *words]) == 0
    assert (home / "bot/msg/__init__.py").is_file()


def test_code_stays_where_the_lock_is(capsys):
    write_all({**FILES, "ws/bot/src/bot/__init__.py": ""})
    assert main(["gen", "ws/bot", "-o", "ws/bot/src/bot"]) == 0
    assert main(["gen", "ws/bot"]) == 0
    (line,) = capsys.readouterr().out.splitlines()[1:]
    assert line.startswith("ws/bot/src/bot: ")
    assert line.endswith(" (unchanged)")


FIND = "from setuptools import find_packages, setup\nsetup(name='bot', "
CFG = "[options]\npackages = find:\n[options.packages.find]\n"


@pytest.mark.parametrize(
    ("files", "home"),
    [
        ({"setup.py": FIND + "packages=find_packages('src'), package_dir={'': 'src'})"}, "src/bot"),
        ({"setup.py": FIND + "packages=find_packages(), package_dir={'': 'a/b/'})"}, "a/b/bot"),
        ({"setup.py": FIND + "packages=['bot'], package_dir={'bot': 'python'})"}, "python"),
        ({"setup.py": FIND + "packages=['bot'], package_dir={'': '../out'})"}, "bot"),
        ({"setup.py": FIND + "packages=['bot'], package_dir={'': '../a'})"}, "bot"),
        ({"setup.py": FIND + "packages=['bot'], package_dir={'': 'a/../../b'})"}, "bot"),
        ({"setup.py": FIND + "packages=['bot'], package_dir=computed())"}, "bot"),
        ({"setup.py": FIND + "packages=computed(), package_dir={'': 'src'})"}, "src/bot"),
        ({"setup.cfg": "[options]\npackages=find:\npackage_dir =\n    =src\n"}, "src/bot"),
        ({"setup.cfg": f"{CFG}where = src\n"}, "src/bot"),
        ({"pyproject.toml": '[tool.setuptools]\npackage-dir = {"" = "lib"}'}, "lib/bot"),
        ({"pyproject.toml": '[tool.setuptools.packages.find]\nwhere = ["lib"]'}, "lib/bot"),
        ({"pyproject.toml": "[tool.setuptools"}, "bot"),
        ({"src/other/__init__.py": ""}, "src/bot"),
    ],
)
def test_a_package_is_compiled_where_setup_py_takes_it_from(files, home):
    plain = {"setup.py": "from setuptools import setup\nsetup(name='bot')\n"}
    write_all(FILES)
    write_all({f"ws/bot/{path}": text for path, text in {**plain, **files}.items()})
    assert main(["gen", "ws/bot"]) == 0
    (lock,) = Path().rglob("idlc.lock")
    assert lock.parent.as_posix() == f"ws/bot/{home}"


def test_other_folders_need_a_place(capsys):
    write_all({"loose/msg/A.msg": "bool a\n"})
    assert main(["gen", "loose"]) == 2
    assert "missing -o OUT" in capsys.readouterr().err


@pytest.mark.parametrize("place", ["ws/bot", "ws"])
def test_the_hint_at_old_code_is_a_command(place, monkeypatch, capsys):
    write_all(FILES)
    monkeypatch.chdir(place)
    folder = "." if place.endswith("bot") else "bot"
    assert main(["gen", folder]) == 0
    Path(folder, "msg/A.msg").write_text("bool b\n")
    Path(folder, "msg/B.msg").unlink()
    Path(folder, "msg/C.msg").write_text("bool c\n")
    main(["check"])
    said = capsys.readouterr().out
    assert "`msg/A.msg` changed, `msg/B.msg` was removed, `msg/C.msg` was added" in said
    (hint,) = re.findall(r"hint: run `idlc (gen .*)`", said)
    assert main(shlex.split(hint)) == 0
    main(["check"])
    assert "IDL460" not in capsys.readouterr().out


@pytest.mark.parametrize("out", ["rclpy", "idlc", "std_msgs", "geometry_msgs", "loose/msg"])
def test_a_place_that_hides_others_is_refused(out, capsys):
    write_all({"loose/msg/A.msg": "bool a\n"})
    assert main(["gen", "loose", "-o", out]) != 0
    assert "nothing was written" in capsys.readouterr().err
    assert sorted(path.name for path in Path().rglob("*.py")) == []


def test_a_service_needs_both_parts(monkeypatch, capsys):
    write_all(FILES)
    monkeypatch.chdir("ws/bot")
    words = ["scaffold", "interface", "srv", "Sort", "bool a", "bool b"]
    assert main(words) == 2
    assert "add `---` before" in capsys.readouterr().err
    assert main([*words[:5], "---", words[5]]) == 0


def test_names_of_packages_are_suggested(capsys):
    assert main(["scaffold", "package", "Sorter-Arm"]) == 2
    assert "did you mean `sorter_arm`?" in capsys.readouterr().err


def test_hashes_are_those_of_the_first_distribution_that_has_any(capsys):
    write_all({"pyproject.toml": '[tool.idlc]\ndistro = ["humble", "jazzy"]\n'})
    assert main(["show", "std_msgs/Header", "--format", "hash"]) == 0
    assert main(["show", "std_msgs/Header", "--format", "hash", "--distro", "humble"]) == 2


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ("ws/bot", []),
        ("ws", ["bot/msg", "-o", "an out"]),
        ("ws", ["bot", "--exclude", "B.msg", "--distro", "humble", "-o", "out"]),
        ("ws", ["-o", "out", "--package", "other", "--", "-odd"]),
        ("ws", ["bot", "--ament", "prefix"]),
        ("ws/set", []),
    ],
)
def test_the_hint_at_a_difference_is_a_command(place, words, monkeypatch, capsys):
    settings = '[tool.idlc]\npaths = ["msg"]\nout = "set"\n'
    write_all(
        {
            **FILES,
            "ws/-odd/A.msg": "bool a\n",
            "ws/set/pyproject.toml": settings,
            "ws/set/msg/A.msg": "bool a\n",
        }
    )
    monkeypatch.chdir(place)
    check = ["gen", "--check", *words]

    def hints():
        capsys.readouterr()
        assert main(check) == 1
        return {*re.findall(r"hint: (?:run )?`idlc (.*?)`", capsys.readouterr().err)}

    (hint,) = hints()
    assert main(shlex.split(hint)) == 0
    assert main(check) == 0
    for file in Path().rglob("*.msg"):
        file.write_text("bool b\n")
    (hint,) = hints()
    assert main(shlex.split(hint)) == 0
    (edited, *_) = [file for file in Path().rglob("__init__.py") if "msg" in file.parts]
    edited.write_text("")
    (hint,) = hints()
    assert hint.endswith(" --force")
    assert main(shlex.split(hint)) == 0
    assert main(check) == 0
