"""A hundred nodes that nobody asked for: random endpoints, types, names and options."""

import os
import random
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from idlc.cli.main import main
from tests.support.nodes import nodes
from tests.support.rounds import FUZZING, SEED

pytestmark = pytest.mark.long

COUNT = 100
#: Of these, every third is started, all by `make fuzz`.
EVERY = 1 if FUZZING else 3
AT_ONCE = 5
TYPES = {
    "msg": (
        *("Odd", "std_msgs/String", "std_msgs/msg/Empty", "sensor_msgs/Imu", "sensor_msgs/Image"),
        *("geometry_msgs/PoseStamped", "nav_msgs/OccupancyGrid", "std_msgs/Float64MultiArray"),
        *("diagnostic_msgs/DiagnosticArray", "builtin_interfaces/Time", "std_msgs/Header"),
    ),
    "srv": (
        "Ask",
        "std_srvs/Empty",
        "std_srvs/SetBool",
        "test_msgs/Arrays",
        "test_msgs/BasicTypes",
    ),
    "action": ("Dock", "test_msgs/Fibonacci", "test_msgs/NestedMessage"),
}
ROLES = {
    "publisher": "msg",
    "subscriber": "msg",
    "service": "srv",
    "client": "srv",
    "action-server": "action",
    "action-client": "action",
}
SPINS = "the node spins"
WAITS = "waiting for a server"
WORDS = ("alpha", "handle", "timer", "tick", "self", "data", "configure", "x", "timeout", "goal")
FIELDS = {
    "msg Odd": (
        'string KIND="a\'b"',
        "string kind",
        "string class",
        "bool pass",
        "byte[3] raw",
        "float32[2] pair",
        'string<=5 short "it\'s"',
        "int32[] list",
        "std_msgs/Header header",
        'uint8 timeout  # percent % of "all" {what} [s]',
    ),
    "srv Ask": (
        "string help",
        "int64 timeout",
        "bool loud",
        "wstring wide",
        "byte b",
        "float64[3] point",
        "string[] words",
        "std_msgs/Header header",
        "---",
        "Odd odd",
    ),
    "action Dock": ("int32 from", "---", "---", "float32 lambda 0.5"),
}


def topic(chance: random.Random) -> str:
    name = "/".join(chance.sample(WORDS, chance.randint(1, 3)))
    return chance.choice(["", "", "/", "~/"]) + name + chance.choice(["", "", "_2"])


def options(chance: random.Random) -> list[str]:
    words: list[str] = []
    for _ in range(chance.choice([0, 1, 1, 1, 2, 3, 4])):
        role = chance.choice(list(ROLES))
        text = f"{chance.choice(TYPES[ROLES[role]])}:{topic(chance)}"
        if role == "publisher" and chance.random() < 0.7:
            text += f"@{chance.choice(['0.5', '1', '3', '7.5', '50', '1000'])}"
        words += [f"--{role}", text]
        if ROLES[role] == "msg" and chance.random() < 0.5:
            words += ["--qos", chance.choice(["default", "sensor_data", "latched"])]
    for _ in range(chance.choice([0, 0, 0, 1, 2])):
        words += ["--timer", chance.choice(["0.1", "0.333", "1", "60"])]
    for name in chance.sample(WORDS, chance.choice([0, 0, 1, 2])):
        value = chance.choice(["bool=true", "int=-3", "double=1e-3", "string=a'b", "int[]=1,2"])
        words += ["--param", f"{name}:{value}"]
    words += ["--robust"] * (chance.random() < 0.4)
    return words + ["--lifecycle"] * (chance.random() < 0.25)


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Path:
    """Return a package with all the nodes, compiled."""
    chance = random.Random(SEED + 3)
    folder = tmp_path_factory.mktemp("combinations")
    here = Path.cwd()
    try:
        os.chdir(folder)
        assert main(["scaffold", "package", "demo"]) == 0
        os.chdir("demo")
        for name, fields in FIELDS.items():
            assert main(["scaffold", "interface", *name.split(), *fields]) == 0
        names = ["imu", "empty", "node", *(f"node_{n}" for n in range(COUNT - 3))]
        for name in names:
            words = options(chance)
            assert main(["scaffold", "node", name, *words]) == 0, words
        assert main(["gen"]) == 0
    finally:
        os.chdir(here)
    return folder / "demo"


@pytest.mark.parametrize(
    "words",
    [
        ["ruff", "check", "--no-cache", "."],
        ["ruff", "format", "--check", "--no-cache", "."],
        pytest.param(["mypy", "--strict"], marks=pytest.mark.jazzy),
        ["pytest", "-q", "test/test_style.py"],
    ],
    ids=["ruff check", "ruff format", "mypy", "ament"],
)
def test_they_pass_every_check(package, words):
    done = subprocess.run(
        [sys.executable, "-m", *words], cwd=package, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, (done.stdout + done.stderr)[-5000:]


def test_they_start_and_end(package, tmp_path, ros_environment):
    names = sorted(path.stem for path in (package / "demo").glob("[!_]*.py"))
    assert len(names) == COUNT
    names = names[::EVERY]
    for first in range(0, len(names), AT_ONCE):
        logs = tmp_path / str(first)
        logs.mkdir()
        with nodes(package, logs, ros_environment) as start:
            batch = [
                start(f"demo.{_speaking(package, name)}", *_patience(package / f"demo/{name}.py"))
                for name in names[first : first + AT_ONCE]
            ]
            for node, how in zip(batch, _signals(), strict=False):
                once = "int:" in _head_of_main(package, node)
                node.until(lambda node=node: _is_up(node))
                status = node.end(how) if node.process.poll() is None else node.process.returncode
                # the moment is the earliest one, in which a signal may still find no handler
                assert status in ((0, 1, 130) if once else (0, -how)), node.output
                assert not node.fails, node.output


def _speaking(package: Path, name: str) -> str:
    """Return the name of a module that says when a short node spins; robust ones end earlier, too.

    A short node that calls a server says that it waits.
    """
    path = package / "demo" / f"{name}.py"
    text = path.read_text()
    spin = re.search(r"rclpy\.spin\((\w+)\(\)\)", text)
    if spin is None:
        return name
    timer = f"node.create_timer(0.1, lambda: print('{SPINS}', flush=True))"
    says = "\n        ".join([f"node = {spin[1]}()", timer, "rclpy.spin(node)"])
    text = text.replace(spin[0], says)
    (package / "demo" / f"{name}_says.py").write_text(text)
    return f"{name}_says"


def _patience(module: Path) -> list[str]:
    return ["--server-timeout", "0.5"] if "--server-timeout" in module.read_text() else []


def _head_of_main(package: Path, node) -> str:
    name = node.process.args[3].partition(".")[2]
    text = (package / "demo" / f"{name}.py").read_text()
    return next(line for line in text.splitlines() if line.startswith("def main("))


def _signals():
    while True:
        yield signal.SIGINT
        yield signal.SIGTERM


def _is_up(node) -> bool:
    """Whether the node handles signals already, or has ended; whether it spins if it is short."""
    if node.process.poll() is not None or SPINS in node.output or WAITS in node.output:
        return True
    if node.process.args[3].endswith("_says"):
        return False
    status = Path(f"/proc/{node.process.pid}/status").read_text()
    caught = next(line for line in status.splitlines() if line.startswith("SigCgt:"))
    return bool(int(caught.split()[1], 16) & (1 << (signal.SIGTERM - 1)))
