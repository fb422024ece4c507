"""The files of docs/first-message.md, and those of the README, are nodes that talk."""

import re
import subprocess
import sys
from html import unescape

import pytest

from tests.support import programs
from tests.support.paths import DOCS, ROOT
from tests.support.waiting import read_line

PAGE = (DOCS / "first-message.md").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("page", ["first-message", "readme"])
def test_the_nodes_of_the_page_talk(page, tmp_path, lonely_environment):
    files = re.findall(r"^```(\S+\.\w+)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    assert [name for name, _ in files] == ["interfaces/msg/Drive.msg", "talker.py", "listener.py"]
    for name, text in files:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    if page == "readme":
        pair = map(unescape, re.findall(r"<pre[^>]*>\n(.*?)</pre>", README, re.DOTALL))
        for text in pair:
            (tmp_path / text.split()[1]).write_text(text, encoding="utf-8")
    (command,) = re.findall(r"^idlc (gen .*)$", PAGE, re.MULTILINE)
    programs.run(sys.executable, "-m", "idlc", *command.split(), cwd=tmp_path)
    (shown,) = re.findall(r"^\$ python listener.py\n(.*)$", PAGE, re.MULTILINE)
    if page == "readme":
        shown = shown.replace(", frame='base'", "")
    environment = {**lonely_environment, "PYTHONPATH": str(ROOT)}
    nodes = [
        subprocess.Popen(
            [sys.executable, name], cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True
        )
        for name in ("listener.py", "talker.py")
    ]
    try:
        assert read_line(nodes[0].stdout).rstrip() == shown
    finally:
        for node in nodes:
            node.kill()
            node.communicate()
