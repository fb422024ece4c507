"""What the README shows is what happens."""

import re
import subprocess
import sys
from html import unescape
from pathlib import Path

from tests.support.paths import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")


def shell(script: str, cwd: Path) -> str:
    programs = f"idlc() {{ '{sys.executable}' -m idlc \"$@\"; }}\n"
    programs += f"python() {{ '{sys.executable}' \"$@\"; }}\nHOME='{cwd}'\n"
    command = ["/bin/sh", "-e", "-c", programs + script]
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_paste_ends_with_a_message(tmp_path):
    (block,) = re.findall(r"^```sh\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)
    _, install, commands = re.split(r"(?m)^(pip install .*)\n", block)
    assert install == "pip install ."
    assert shell(commands, tmp_path).endswith("\nmy_robot.msg.Drive(speed=1.5)\n")


def test_the_node_uses_the_message(tmp_path):
    """The node itself runs in tests/ros/test_first_message.py."""
    message, node = map(unescape, re.findall(r"<pre[^>]*>\n(.*?)</pre>", README, re.DOTALL))
    assert "\n\n" not in message + node, "an empty line would end the table"
    (tmp_path / "msg").mkdir()
    (tmp_path / "msg/Drive.msg").write_text(message, encoding="utf-8")
    shell("idlc gen msg --package my_robot -o my_robot", tmp_path)
    (made,) = re.findall(r"Drive\(.*?\)(?=\))", node)
    shell(f"python -c 'from my_robot.msg import Drive; print({made})'", tmp_path)


def test_it_stays_short():
    assert len(README.splitlines()) < 90
    assert len(README.split()) < 900


def test_every_command_exists():
    commands = set(re.findall(r"`idlc ([a-z]+)", README))
    assert {"check", "gen", "breaking"} <= commands
    for command in commands:
        shell(f"idlc {command} --help", ROOT)
