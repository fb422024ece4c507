"""docs/change-a-message.md: its commands, on its message, with the exit statuses that it shows."""

import re
import shlex
import subprocess

import idlc
from idlc.cli.main import main
from tests.support.paths import DOCS
from tests.support.tools import tool
from tests.upgrading.test_command import write_recording

TEXT = (DOCS / "change-a-message.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```(text|sh)([^\n]*)\n(.*?)```", TEXT, re.DOTALL)


def git(*words):
    who = ("-c", "user.name=Ada", "-c", "user.email=ada@example.com")
    subprocess.run([tool("git"), *who, *words], check=True, capture_output=True)


def test_its_commands_upgrade_and_translate(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "my_msgs/msg/Drive.msg"
    path.parent.mkdir(parents=True)
    versions = 0
    for kind, head, body in BLOCKS:
        if kind == "text":
            path.write_text(body, encoding="utf-8")
            versions += 1
            if versions == 1:
                old = idlc.load("my_msgs")
                messages = [old.Drive(speed=3, angle=180)]
                write_recording(tmp_path / "drive.mcap", old.Drive, messages)
                write_recording(tmp_path / "old.mcap", old.Drive, messages, defined=False)
                for words in (["init", "-q"], ["add", "."], ["commit", "-qm", "v1"], ["tag", "v1"]):
                    git(*words)
            continue
        status = int(head.partition("=")[2] or 0)
        for line in body.splitlines():
            program, *words = shlex.split(line)
            if program == "cd":
                monkeypatch.chdir(words[0])
            else:
                assert main(words) == status, line
            if "--write-rules" in words:
                for rules in (tmp_path / "my_msgs/upgrade").glob("drive*.py"):
                    text = rules.read_text(encoding="utf-8")
                    assert "return old.speed" in text
                    assert "0.017453292519943295" in text
    assert versions == 2
    new = idlc.load(tmp_path / "my_msgs")
    for name in ("drive", "old"):
        with idlc.Recording(tmp_path / f"upgraded/{name}.mcap") as recording:
            (view,) = [view for batch in recording["/drive"].batches() for view in batch.views()]
            message = new.Drive.deserialize(view)
        assert (message.velocity, round(message.angle, 6), message.gear) == (3.0, 3.141593, 1)
    conversion = (tmp_path / "bridge/bridge/translator_conversion.py").read_text(encoding="utf-8")
    assert "NotImplementedError" not in conversion
