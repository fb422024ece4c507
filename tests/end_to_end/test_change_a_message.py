"""docs/change-a-message.md: its commands, on its message, with the exit statuses that it shows."""

import re
import shlex
import subprocess

import idlc
from idlc.cli.main import main
from tests.support.files import write
from tests.support.paths import DOCS
from tests.support.tools import tool
from tests.tasks.test_upgrade import write_recording

TEXT = (DOCS / "change-a-message.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```(text|sh)([^\n]*)\n(.*?)```", TEXT, re.DOTALL)


def git(*words):
    who = ("-c", "user.name=Ada", "-c", "user.email=ada@example.com")
    subprocess.run([tool("git"), *who, *words], check=True, capture_output=True)


def follow(folder, monkeypatch, more=({}, {})):
    """Run the page's commands in a new folder; `more` are further files of the two versions."""
    folder.mkdir()
    monkeypatch.chdir(folder)
    versions = 0
    for kind, head, body in BLOCKS:
        if kind == "text":
            for path, text in {head.strip(): body, **more[versions]}.items():
                write(folder / path, text)
            versions += 1
            if versions == 1:
                old = idlc.load("my_msgs")
                messages = [old.Drive(speed=3, angle=180)]
                write_recording(folder / "drive.mcap", old.Drive, messages)
                write_recording(folder / "old.mcap", old.Drive, messages, defined=False)
                for words in (["init", "-q"], ["add", "."], ["commit", "-qm", "v1"], ["tag", "v1"]):
                    git(*words)
            continue
        status = int(head.partition("=")[2] or 0)
        for line in body.splitlines():
            program, *words = shlex.split(line)
            if program == "git":
                git(*words)
            else:
                assert main(words) == status, line
            if "--write-rules" in words:
                for rules in (folder / "my_msgs/upgrade").glob("drive*.py"):
                    text = rules.read_text(encoding="utf-8")
                    assert "return old.speed" in text
                    assert "0.017453292519943295" in text
    assert versions == 2


def test_its_commands_upgrade(tmp_path, monkeypatch):
    tmp_path /= "work"
    follow(tmp_path, monkeypatch)
    new = idlc.load(tmp_path / "my_msgs")
    for name in ("drive", "old"):
        with idlc.Recording(tmp_path / f"upgraded/{name}.mcap") as recording:
            (view,) = [view for batch in recording["/drive"].batches() for view in batch.views()]
            message = new.Drive.deserialize(view)
        assert (message.velocity, round(message.angle, 6), message.gear) == (3.0, 3.141593, 1)
