"""Where services show what is in no file of the repository: what is gone, and what was recorded."""

import json
import subprocess

import pytest

from idlc.cli.main import main
from tests.support import recorded_text
from tests.support.sarif_schema import path_of, run_of
from tests.support.tools import tool

WRONG_HASH = "RIHS01_" + "0" * 64


@pytest.fixture
def repository(here):
    """A package from which a message was removed, since it was recorded and committed."""
    (here / "src/demo/msg").mkdir(parents=True)
    (here / "src/demo/msg/Gone.msg").write_text("int8 a\n", encoding="utf-8")
    (here / "src/demo/msg/Kept.msg").write_text("string b\n", encoding="utf-8")
    git = [tool("git"), "-c", "user.name=a", "-c", "user.email=a@b"]
    for words in (["init", "-q"], ["add", "-A"], ["commit", "-q", "-m", "first"]):
        subprocess.run([*git, *words], check=True, cwd=here)
    (here / "src/demo/msg/Gone.msg").unlink()
    recorded_text.write("a.mcap", "@ /x demo/msg/Gone\nint8 a\n")
    return here


def shown(capsys, *words):
    """Return path and message of what is found, as each service is told."""
    capsys.readouterr()
    assert main([*words, "--format", "sarif"]) == 1
    (sarif,) = run_of(capsys.readouterr().out)["results"]
    assert main([*words, "--format", "gitlab"]) == 1
    (gitlab,) = json.loads(capsys.readouterr().out)
    assert main([*words, "--format", "github"]) == 1
    github = capsys.readouterr().out.splitlines()[0]
    (location,) = sarif["locations"]
    path = path_of(location)
    assert gitlab["location"]["path"] == path
    assert f"file={path}," in github
    inside = location["physicalLocation"].get("region")
    assert ("line=" in github) == (inside is not None)
    return path, sarif["message"]["text"]


@pytest.mark.parametrize(
    ("against", "was"),
    [("git:HEAD", "git:HEAD:src/demo/msg/Gone.msg"), ("a.mcap", "a.mcap: topic /x: demo/msg/G")],
)
def test_what_was_removed_is_shown_where_it_was(against, was, repository, capsys):
    path, text = shown(capsys, "breaking", "src/demo", "--against", against)
    assert path == "src/demo/msg/Gone.msg"
    assert f"in {was}" in text
    assert main(["breaking", "src/demo", "--against", against]) == 1
    assert f" --> {was}" in capsys.readouterr().out


def test_what_is_wrong_in_a_recording_is_shown_in_its_file(here, capsys):
    recorded_text.write("a.mcap", "@ /x demo/msg/Bad\n\nint80 a\n")
    path, text = shown(capsys, "check", "a.mcap")
    assert path == "a.mcap"
    assert "in a.mcap: topic /x: demo/msg/Bad.msg" in text
    recorded_text.write("a.mcap", f"@ /x demo/msg/Good ros2msg {WRONG_HASH}\nint8 a\n")
    assert main(["check", "a.mcap", "--format", "sarif"]) == 0
    (found,) = run_of(capsys.readouterr().out)["results"]
    assert path_of(found["locations"][0]) == "a.mcap"
