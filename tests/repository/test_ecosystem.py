"""`python -m maintenance.ecosystem` notices what idlc breaks in clones of repositories."""

import json

import pytest

from maintenance.ecosystem import __main__ as ecosystem
from tests.support.files import write, write_all
from tests.support.projects import ament
from tests.support.repositories import git


@pytest.fixture
def clones(here):
    """Two repositories with tags: one of a Python package, one of an interface package."""
    write_all({f"clones/bot/src/{path}": text for path, text in ament().items()})
    write("clones/sea/package.xml", "<package format='3'><name>sea_msgs</name></package>")
    for tag, kind in (("v1", "int32"), ("v2", "int64")):
        write("clones/sea/msg/Wave.msg", f"{kind} height\n")
        for name in ("bot", "sea"):
            if tag == "v1":
                git("init", "-q", cwd=f"clones/{name}")
            git("add", ".", cwd=f"clones/{name}")
            git("commit", "-q", "--allow-empty", "-m", tag, cwd=f"clones/{name}")
            git("tag", tag, cwd=f"clones/{name}")
    return here / "clones"


def run(monkeypatch, *words):
    """Return the status of the program."""
    monkeypatch.setattr("sys.argv", ["ecosystem", *map(str, words)])
    return ecosystem.main()


def test_lost_files_and_crashes_are_faults(clones, monkeypatch, capsys):
    """The wheels after `init` lack a file; `gen` ends with a traceback."""
    wheels = {"fix": {"bot/a.py", "bot/b.py"}, "init": {"bot/a.py", "bot/msg/_x.py"}}

    def wheel_files(package, _scratch):
        kind = next((name for name in wheels if f"/{name}/" in str(package)), "fix")
        return wheels[kind]

    monkeypatch.setattr(ecosystem, "wheel_files", wheel_files)
    monkeypatch.setattr(ecosystem, "idlc", lambda _, *words: "CRASH" if "gen" in words else "0")
    assert run(monkeypatch, clones, "--json", "facts.json") == 1
    shown = capsys.readouterr().out.splitlines()
    assert shown[0].startswith("bot: check 0, fix 0, wheels after fix 1/1, init 0,")
    assert shown[-1] == "2 repositories, 2 with faults of idlc: bot, sea"
    bot, sea = json.loads((clones.parent / "facts.json").read_text())
    assert bot["lost by init"] == ["src: bot/b.py"]
    assert (sea["lost by init"], sea["gen"]) == ([], "CRASH")


def test_two_repositories_are_examined(clones, monkeypatch, capsys):
    assert run(monkeypatch, clones) == 0
    bot, sea, summary = capsys.readouterr().out.splitlines()
    assert "wheels after fix 1/1, init 0, wheels after init 1/1" in bot
    assert sea.endswith("gen 0, import 0, breaking 1")
    assert summary.startswith("2 repositories, 0 with faults")
    assert git("status", "--porcelain", cwd=clones / "bot") == b""


@pytest.mark.parametrize(("place", "is_lost"), [("bot", True), ("build/bot", False)])
def test_what_cmake_builds_has_no_classes_in_wheels(place, is_lost, here, monkeypatch):
    monkeypatch.setattr(ecosystem, "wheel_files", lambda *_: {"bot/a.py"})
    write_all({"clone/bot/setup.py": "", "clone/bot/package.xml": ""})
    write(f"new/bot/{place}/msg/_{ecosystem.MODULE}.py", "")
    _, lost = ecosystem.lost_files(here / "clone", here / "new", here)
    assert lost == ["bot: the classes are not installed"] * is_lost
