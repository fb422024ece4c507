"""Repositories of git for tests, and gits that do not answer as they should."""

import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path

from tests.support.files import write

GIT = shutil.which("git") or "git"
_WHO = ("-c", "user.name=me", "-c", "user.email=me@example.org", "-c", "commit.gpgsign=false")


def git(*words, given=b"", cwd=None):
    """Run the real git; return what it prints."""
    command = [GIT, *_WHO, "-c", "protocol.file.allow=always", *words]
    done = subprocess.run(command, check=True, capture_output=True, input=given, cwd=cwd)
    return done.stdout


def changed(folder):
    """Make a repository in which `p/msg/A.msg` was int32 and is int64 now; both are committed."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    git("init", "-q", "-b", "main", cwd=folder)
    for kind in ("int32", "int64"):
        write(folder / "p/msg/A.msg", f"{kind} a\n")
        write(folder / "p/msg/Same.msg", "int8 same\n")
        git("add", ".", cwd=folder)
        git("commit", "-qm", kind, cwd=folder)
    return folder


def instead(monkeypatch, folder, script):
    """Put a git on PATH that is a script of sh, with $GIT for the real one."""
    folder.mkdir(exist_ok=True)
    program = folder / "git"
    program.write_text(f"#!/bin/sh\nGIT={shlex.quote(GIT)}\n{script}\n", encoding="utf-8")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")


def version():
    """Return the version of the real git, as numbers."""
    return tuple(map(int, re.findall(r"\d+", git("--version").decode())[:2]))
