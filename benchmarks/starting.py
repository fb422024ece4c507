"""Commands from start to end, start-up included: what a person or a commit hook waits for.

The times are CPU time of the whole process. Commands run in an interpreter without ROS's start-up
hook, which makes every interpreter start twice.
"""

import shutil
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from benchmarks.measure import IDLC, Goal, Row
from benchmarks.peers import installed
from benchmarks.processes import plain_python, seconds
from benchmarks.work import Work

FILE = "demo_msgs/msg/Drive.msg"
TEXT = "std_msgs/Header header\nfloat64 speed  # forwards [m/s]\nfloat64 turn  # left [rad/s]\n"
PEER = "ros2-pkg-create"
PEER_OPTIONS = ("--use-local-templates", "--defaults", "--template", "ros2_interfaces_pkg")


def rows(work: Work) -> Iterator[Row]:
    version = Goal(at_most=3, than="bare interpreter")
    check = Goal(at_most=5, than="bare interpreter")
    yield Row("start", "idlc --version", partial(command, work, "--version"), version, rounds=25)
    yield Row("start", "idlc check FILE", partial(command, work, "check", FILE), check, rounds=25)
    ahead = Goal(times=1)
    yield Row("start", "scaffold --help", partial(scaffold_help, work), ahead, rounds=15)
    yield Row("start", "scaffold a package", partial(scaffold, work), ahead, rounds=15)


def place(work: Work) -> tuple[Path, Path]:
    """Return an interpreter, and a folder with an interface to check."""
    folder = work.folder / "starting"
    if not folder.exists():
        (folder / FILE).parent.mkdir(parents=True)
        (folder / FILE).write_text(TEXT, encoding="utf-8")
        plain_python(folder / "python")
    return folder / "python" / "bin" / "python", folder


def command(work: Work, *words: str):
    python, folder = place(work)
    return {
        IDLC: partial(seconds, [python, "-m", "idlc", *words], folder),
        "bare interpreter": partial(seconds, [python, "-c", ""], folder),
    }


def scaffold_help(work: Work):
    python, folder = place(work)
    commands = {IDLC: [python, "-m", "idlc", "scaffold", "--help"]}
    if installed(PEER):
        commands[PEER] = [python, "-m", "ros2_pkg_create", "--help"]
    return {who: partial(seconds, words, folder) for who, words in commands.items()}


def scaffold(work: Work):
    """Return candidates that make a package of interfaces."""
    python, folder = place(work)
    name = "made_msgs"
    options = ("--interfaces",)
    commands = {IDLC: [python, "-m", "idlc", "scaffold", "package", name, *options]}
    if installed(PEER):
        words = [python, "-m", "ros2_pkg_create", *PEER_OPTIONS, "--package-name", name, "."]
        commands[PEER] = words
    return {
        who: partial(made, words, folder / who.replace("-", "_"), name)
        for who, words in commands.items()
    }


def made(words: list[object], folder: Path, name: str) -> float:
    """Return the seconds that making a package takes in a new folder."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    taken = seconds(words, folder)
    assert (folder / name / "package.xml").is_file(), words
    return taken
