"""docs/robot-nodes.md: its programs run, and talk to each other."""

import os
import re
import subprocess
import sys

from idlc.robot.keys import EntityKind
from tests.robot.conftest import environ_of
from tests.robot.nodes import LONG, SetBool, node_at
from tests.support.paths import ROOT

PAGE = (ROOT / "docs/robot-nodes.md").read_text(encoding="utf-8")
TALKER, LISTENER = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
ARGUMENTS, *_ = re.findall(r"^python talker\.py (.*)$", PAGE, re.MULTILINE)


def test_the_programs_of_the_page_talk_to_each_other(address, tmp_path):
    environ = {**os.environ, **environ_of(address)}
    talker, listener = tmp_path / "talker.py", tmp_path / "listener.py"
    talker.write_text(TALKER, encoding="utf-8")
    listener.write_text(LISTENER, encoding="utf-8")
    command = [sys.executable, talker, *ARGUMENTS.split()]
    with (
        node_at(address, "node") as node,
        subprocess.Popen(command, env=environ, stderr=subprocess.PIPE, text=True) as process,
    ):
        try:
            graph = node.graph
            assert graph.wait_for(lambda _: graph.count(EntityKind.PUBLISHER, "/greetings"), LONG)
            done = subprocess.run(
                [sys.executable, listener],
                env=environ,
                capture_output=True,
                text=True,
                timeout=LONG,
                check=True,
            )
            assert done.stdout == "hello\n"
            client = node.create_client(SetBool, "switch")
            assert client.wait_for_service(timeout_sec=LONG)
            assert client.call(SetBool.Request(), LONG).success
            process.terminate()
            _, errors = process.communicate(timeout=LONG)
        finally:
            process.kill()
    assert re.fullmatch(r"\[INFO\] \[\d+\.\d{9}\] \[talker\]: hello\n", errors)
