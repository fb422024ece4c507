"""Pictures of a terminal: what commands really print, as SVG for dark and light screens.

The commands of a scene appear one after the other, except on phones and for readers who asked for
less motion.

`IDLC_REFRESH=docs/pictures pytest tests/website` makes those in docs/pictures anew.
"""

from __future__ import annotations

import os
import re
import shlex
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from html import escape
from pathlib import Path
from typing import NamedTuple

_ROOT = Path(__file__).parents[2]
_SIZE, _WIDTH, _HEIGHT, _EDGE = 14, 8.43, 20, 18
#: Seconds between two commands.
_PAUSE = 1.6
#: The nodes of a scene meet each other, on this machine, and nobody else.
_OWN_DOMAIN = {"ROS_DOMAIN_ID": "229", "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
#: `python -m idlc.robot` refuses to take the place of an rclpy that is installed.
_WITHOUT_ROS = """import importlib.util as util
find = util.find_spec
util.find_spec = lambda name, package=None: None if name == "rclpy" else find(name, package)
"""
#: What the codes of a terminal mean, in the style sheet of a picture.
_CLASSES = {
    "1": "b",
    "2": "d",
    "31": "r",
    "32": "g",
    "33": "y",
    "34": "u",
    "94": "u",
    "35": "m",
    "36": "c",
}
#: Colours by class, for a light screen and a dark one; each has a contrast of 4.5 or more.
COLOURS = {
    "box": ("#f6f8fa", "#10151c"),
    "t": ("#1f2328", "#d7dee8"),
    "d": ("#59636e", "#8a97a8"),
    "r": ("#cf222e", "#ff7b72"),
    "g": ("#116329", "#7ee787"),
    "y": ("#7d4e00", "#e3b341"),
    "u": ("#0550ae", "#79c0ff"),
    "m": ("#8250df", "#d2a8ff"),
    "c": ("#0e6a75", "#76e3ea"),
}


def style(font: str, more: str = "") -> str:
    """Return the style sheet of a picture, which follows the screen of the reader."""
    light, dark = (
        " ".join(f".{name} {{ fill: {pair[number]} }}" for name, pair in COLOURS.items())
        for number in (0, 1)
    )
    return (
        f"<style>\ntext {{ font: {font} }} .b {{ font-weight: bold }}\n{light}\n"
        f"@media (prefers-color-scheme: dark) {{ {dark} }}{more}\n</style>"
    )


_MOTION = """
@keyframes appear { from { opacity: 0 } }
@media (prefers-reduced-motion: no-preference) and (min-width: 560px) {
g { animation: appear .3s backwards } }"""
_CODE = re.compile(r"\x1b\[([\d;]*)m")


class Scene(NamedTuple):
    """Files in an empty folder, and commands that are typed there.

    A command that ends with `&` runs until the end. Its first line is shown if it is `answering`.
    """

    files: Mapping[str, str]
    commands: tuple[str, ...]
    answering: tuple[str, ...] = ()


_DRIVE = {"interfaces/msg/Drive.msg": "float64 speed 0.5  # forward [m/s]\n"}
_NODE = """import rclpy
from my_robot.msg import Drive

rclpy.init()
node = rclpy.create_node("{0}")
{1}
rclpy.spin(node)
"""
_TALKER = """publisher = node.create_publisher(Drive, "drive", 10)
timer = node.create_timer(0.5, lambda: publisher.publish(Drive(speed=1.5)))"""
_LISTENER = 'node.create_subscription(Drive, "drive", lambda drive: print(drive, flush=True), 10)'
SCENES = {
    "first": Scene(
        _DRIVE,
        (
            "cat interfaces/msg/Drive.msg",
            "idlc gen interfaces -o my_robot",
            "python -c 'from my_robot.msg import Drive; print(Drive(speed=1.5))'",
            "python -c 'from my_robot.msg import Drive; print(Drive().serialize().hex())'",
        ),
    ),
    "robot": Scene(
        {
            **_DRIVE,
            "talker.py": _NODE.format("talker", _TALKER),
            "listener.py": _NODE.format("listener", _LISTENER),
        },
        (
            "idlc gen interfaces -o my_robot",
            "python -m idlc.robot talker.py &",
            "python -m idlc.robot listener.py &",
            "idlc echo dds /drive --count 1",
        ),
        ("python -m idlc.robot listener.py &",),
    ),
    "check": Scene(
        {
            "my_robot/msg/Scan.msg": "# One turn of the scanner.\n\n"
            "float64 stamp\nflot64[<=3] ranges  # [m]\nfloat32 angle  # [deg]\n"
        },
        ("idlc check my_robot",),
    ),
    "breaking": Scene(
        {
            "old/msg/Drive.msg": "float64 speed  # [m/s]\nuint8 gear\n",
            "new/msg/Drive.msg": "float32 speed  # [m/s]\nuint8 gear\nstring frame\n",
        },
        ("idlc breaking new --against old --package my_robot",),
    ),
    "show": Scene(
        {
            "my_robot/package.xml": "<package><name>my_robot</name></package>",
            "my_robot/msg/Wheel.msg": "float32 speed  # at the rim [m/s]\nbool blocked\n",
            "my_robot/msg/Drive.msg": "# How to drive.\n\nuint8 SLOW=0\nuint8 FAST=1\n"
            'uint8 mode 1\nWheel[4] wheels\nstring<=16 frame "base"  # of the path\n',
        },
        ("idlc show my_robot/msg/Drive.msg",),
    ),
}


def picture(scene: Scene) -> str:
    """Return a scene as SVG."""
    steps = []
    with tempfile.TemporaryDirectory() as folder, ExitStack() as running:
        for path, text in {**scene.files, ".start/sitecustomize.py": _WITHOUT_ROS}.items():
            (Path(folder) / path).parent.mkdir(parents=True, exist_ok=True)
            (Path(folder) / path).write_text(text, encoding="utf-8")
        for command in scene.commands:
            process = _started(command.removesuffix("&"), folder)
            running.callback(_ended, process)
            assert process.stdout is not None
            if not command.endswith("&"):
                printed = process.stdout.read()
            else:
                printed = process.stdout.readline() if command in scene.answering else ""
            lines = printed.rstrip("\n").splitlines()
            steps.append([f"\x1b[2m$\x1b[0m \x1b[1m{command}\x1b[0m", *lines])
    return _svg(steps)


def _started(command: str, folder: str) -> subprocess.Popen[str]:
    python = shlex.quote(sys.executable)
    programs = f'idlc() {{ {python} -m idlc "$@"; }}; python() {{ {python} "$@"; }}\n'
    paths = f"{folder}/.start{os.pathsep}{_ROOT}"
    environment = {**os.environ, "FORCE_COLOR": "1", "NO_COLOR": "", "PYTHONPATH": paths}
    return subprocess.Popen(
        ["/bin/sh", "-c", programs + command],
        cwd=folder,
        env={**environment, **_OWN_DOMAIN},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
        start_new_session=True,
    )


def _ended(process: subprocess.Popen[str]) -> None:
    """End a command, and what its shell started."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _svg(steps: list[list[str]]) -> str:
    columns = max(len(_CODE.sub("", line)) for lines in steps for line in lines)
    groups, number = [], 0
    for step, lines in enumerate(steps):
        texts = [
            f'<text class="t" x="{_EDGE}" y="{_EDGE + _SIZE + row * _HEIGHT}" xml:space="preserve" '
            f'textLength="{len(_CODE.sub("", line)) * _WIDTH:.0f}">{_spans(line)}</text>'
            for row, line in enumerate(lines, number)
            if line
        ]
        delay = f' style="animation-delay: {step * _PAUSE:.1f}s"' if len(steps) > 1 else ""
        groups += [f"<g{delay}>", *texts, "</g>"] if delay else texts
        number += len(lines)
    font = f"{_SIZE}px ui-monospace, Menlo, Consolas, monospace"
    sheet = style(font, _MOTION if len(steps) > 1 else "")
    return svg(round(columns * _WIDTH + 2 * _EDGE), number * _HEIGHT + 2 * _EDGE, sheet, groups)


def svg(width: int, height: int, sheet: str, parts: list[str]) -> str:
    """Return a picture of a size, with a box behind its parts."""
    size = f'width="{width}" height="{height}" viewBox="0 0 {width} {height}"'
    box = '<rect class="box" width="100%" height="100%" rx="8"/>'
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" {size}>', sheet, box, *parts, "</svg>\n"]
    return "\n".join(lines)


def _spans(line: str) -> str:
    """Return a line of a terminal as pieces of SVG text."""
    spans, codes, end = [], "", 0
    for found in [*_CODE.finditer(line), None]:
        text = escape(line[end : found.start() if found else None], quote=False)
        names = " ".join(_CLASSES[code] for code in codes.split(";") if code in _CLASSES)
        if text:
            spans.append(f'<tspan class="{names}">{text}</tspan>' if names else text)
        if found:
            codes = "" if found[1] in ("", "0") else f"{codes};{found[1]}"
            end = found.end()
    return "".join(spans)
