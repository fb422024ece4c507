"""The proof of `idlc init`, with builds that do odd things."""

import os
import signal
import sys

import pytest

from idlc.scaffold.proof import prove
from tests.support.files import write

SETUP = """
import os, subprocess, sys
from setuptools import setup
from beside import version
words = [sys.executable, "-c", "import time; time.sleep(120)"]
left = [subprocess.Popen(words), subprocess.Popen(words, start_new_session=True)]
left.append(subprocess.Popen(words, stdin=subprocess.PIPE))
open({!r}, "a").write("".join(f"{{process.pid}}\\n" for process in left))
setup(name="odd", version=version, packages=["odd"])
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_processes_that_a_build_leaves_behind_are_not_waited_for(tmp_path):
    package, left = tmp_path / "odd", tmp_path / "left"
    write(package / "setup.py", SETUP.format(str(left)))
    write(package / "beside.py", "version = '1'\n")  # only old builds find it
    write(package / "odd/__init__.py", "class A: pass\n")
    proof = prove(package, "setuptools.build_meta", ("odd.A",), package)
    processes = list(map(int, left.read_text(encoding="utf-8").split()))
    for process in processes:
        os.kill(process, signal.SIGKILL)  # it is still there
    assert proof.failure == ""
    assert len(processes) >= 3
