"""A folder with a package in it, and a process that runs idlc there and commits faults."""

import contextlib
import json
import os
import shutil
import stat
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

import idlc
from tests.support.waiting import LIMIT, read_line

HERE = Path(__file__).parent
GEN = ["gen", "pkg", "-o", "out/demo"]


class Machine:
    """A folder with a package in it, and a process that runs idlc there and commits faults."""

    def __init__(self, folder, code):
        self.folder = folder
        self.process = subprocess.Popen(
            [sys.executable, str(HERE / "faults.py"), str(folder)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONUTF8": "1", "PYTHONPATH": code},
            text=True,
        )

    def run(self, words=GEN, **fault):
        self.process.stdin.write(json.dumps({"words": list(words), **fault}) + "\n")
        self.process.stdin.flush()
        return json.loads(read_line(self.process.stdout))

    def write(self, files):
        shutil.rmtree(self.folder / "pkg", ignore_errors=True)
        for path, text in files.items():
            target = self.folder / "pkg" / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(text, encoding="utf-8")

    def reset(self, out):
        """Make the output what it was; `None` for none."""
        shutil.rmtree(self.folder / "out", ignore_errors=True)
        if out is not None:
            shutil.copytree(out, self.folder / "out")

    @property
    def tree(self):
        return tree(self.folder / "out")


@contextlib.contextmanager
def running():
    """Start a machine in a folder of its own, and end it."""
    # pytest's own folders are closed to other users, and that of idlc may be
    with TemporaryDirectory() as name, TemporaryDirectory() as code:
        folder = Path(name).resolve()
        (folder / ".git").mkdir()
        source = Path(idlc.__file__).parent
        for part in (source, source.with_name("templates")):
            if part.is_dir():  # an installed idlc has its templates inside
                shutil.copytree(part, Path(code, part.name))
        folder.chmod(0o755)
        Path(code).chmod(0o755)
        found = Machine(folder, code)
        yield found
        found.process.stdin.close()
        found.process.wait(LIMIT)


def another_user(folder):
    """Return the fault of being another user, where only root may do all; else none.

    Leave the test out where the user may not enter a folder.
    """
    if os.getuid() != 0:
        return {}
    for parent in folder.parents:
        if not parent.stat().st_mode & stat.S_IXOTH:
            pytest.skip(f"no other user may enter {parent}: set TMPDIR to a folder for all")
    return {"user": 65534}


def tree(out):
    """Return the files below a folder, without what only an interrupted run leaves there."""
    return {
        path.relative_to(out).as_posix(): path.read_bytes()
        for path in sorted(out.rglob("*"))
        if path.is_file() and ".idlc-stage-" not in path.as_posix()
    }
