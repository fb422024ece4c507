"""idlc's classes in a busy, dying and hostile system; `make soak` makes it a million messages."""

import random
import re
import select
import shutil
import time
from pathlib import Path

import pytest

from idlc.project.prefixes import distribution
from tests.support.installed import generate
from tests.support.paths import EVERY_KIND
from tests.support.rounds import FUZZING
from tests.support.waiting import LIMIT, WORK, read_line

#: Each is delivered eight times.
MESSAGES = 125_000 if FUZZING else 1_200
#: Seconds for all messages.
TIMEOUT = 3600 if FUZZING else WORK
THING = "string name\nint32[] numbers\nstring[] words\nEverything[] rest\n"
EVERYTHING = (
    "Scalars scalars\nArrays arrays\nBoundedSequences bounded\nSequences sequences\n"
    "Arrays[2] pair\nBoundedSequences[<=3] few\nSequences[] many\n"
)
#: A type of the same name that means something else.
OTHER = "float64 value\nuint32 count\nuint32[8] more\nstring name\n"
JAZZY = distribution().name == "jazzy"


@pytest.fixture(scope="module")
def sides(tmp_path_factory) -> dict[str, Path]:
    """Return a folder with the package `same` for each side."""
    found = {}
    for side, text in (("sound", THING), ("other", OTHER)):
        folder = tmp_path_factory.mktemp(side)
        shutil.copytree(EVERY_KIND / "msg", folder / "files/msg")
        (folder / "files/msg/Others.msg").unlink()  # needs other packages
        (folder / "files/msg/Everything.msg").write_text(EVERYTHING, encoding="utf-8")
        (folder / "files/msg/Thing.msg").write_text(text, encoding="utf-8")
        generate(folder / "files", folder / "same")
        found[side] = folder
    return found


@pytest.fixture
def start(sides, program):
    """Start a function of load.py."""

    def begin(*words, side="sound"):
        return program("load.py", *words, path=sides[side])

    return begin


#: What rclpy says of its own when a subscription died between waiting and taking.
OF_RCLPY = re.compile(r"The following exception was never retrieved: cannot use Destroyable.*\n")


@pytest.mark.long
def test_eight_publishers_and_eight_subscribers_that_die(start):
    load = start("eight_by_eight", MESSAGES)
    chance = random.Random(1)
    for _ in range(3 + MESSAGES // 10_000):
        doomed = start("doomed")
        assert read_line(doomed.stdout) == "ready\n", doomed.stderr.read()
        received, _, _ = select.select([doomed.stdout], [], [], LIMIT)
        assert received, "nothing is sent"
        time.sleep(chance.random() / 2)
        doomed.kill()
    out, complaints = load.communicate("enough\n", timeout=TIMEOUT)
    assert (load.returncode, OF_RCLPY.sub("", complaints)) == (0, "")
    published, deaths, warm, last = map(float, out.split())
    assert published > MESSAGES * 0.9
    assert deaths > 5
    if FUZZING:
        assert last - warm < 6


@pytest.mark.parametrize("how", ["exit", "shutdown", "raise", "end"])
def test_the_interpreter_ends_within_a_callback(how, start):
    process = start("ends_within_a_callback", how)
    _, complaints = process.communicate()
    assert process.returncode == 0, complaints
    assert "Fatal" not in complaints


def test_hostile_peers(start):
    victim = start("victim")
    assert read_line(victim.stdout) == "ready\n"
    count = 400
    liar, stranger = (start("attacker", count, side=side) for side in ("sound", "other"))
    friend = start("friend", count // 4)
    for process in (liar, stranger, friend):
        done, _, connected = read_line(process.stdout).partition(" ")
        assert done == "done", process.stderr.read()
        # from Kilted on, the middleware looks at types itself, and connects no strangers
        assert int(connected) == 1 or (process is stranger and not JAZZY)
    received = 0
    for _ in range(LIMIT * 20):
        time.sleep(0.05)
        victim.stdin.write("?\n")
        victim.stdin.flush()
        received = int(read_line(victim.stdout))
        if received == count // 4:
            break
    assert received > count // 8
    for process in (liar, stranger, friend, victim):
        _, complaints = process.communicate()
        assert process.returncode == 0, complaints
