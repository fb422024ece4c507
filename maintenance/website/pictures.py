"""Pictures of a terminal: what commands really print, as SVG.

`IDLC_REFRESH=docs/pictures pytest tests/website` makes those in docs/pictures anew.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import NamedTuple

_ROOT = Path(__file__).parents[2]
_SIZE, _WIDTH, _HEIGHT, _EDGE = 14, 8.43, 20, 18
#: What the codes of a terminal mean, in the style sheet of a picture.
_CLASSES = {"1": "b", "2": "d", "31": "r", "32": "g", "33": "y", "34": "u", "35": "m", "36": "c"}
_STYLE = f"""
.box {{ fill: #10151c }} .b {{ font-weight: bold }} .d {{ fill: #8a97a8 }} .r {{ fill: #ff7b72 }}
text {{ font: {_SIZE}px ui-monospace, Menlo, Consolas, monospace; fill: #d7dee8 }}
.g {{ fill: #7ee787 }} .y {{ fill: #e3b341 }} .u {{ fill: #79c0ff }} .m {{ fill: #d2a8ff }}
.c {{ fill: #76e3ea }}"""
_CODE = re.compile(r"\x1b\[([\d;]*)m")


class Scene(NamedTuple):
    """Files in an empty folder, and commands that are typed there."""

    files: Mapping[str, str]
    commands: tuple[str, ...]


SCENES = {
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
    lines = []
    with tempfile.TemporaryDirectory() as folder:
        for path, text in scene.files.items():
            (Path(folder) / path).parent.mkdir(parents=True, exist_ok=True)
            (Path(folder) / path).write_text(text, encoding="utf-8")
        for command in scene.commands:
            lines += [f"\x1b[2m$\x1b[0m \x1b[1m{command}\x1b[0m", *_printed(command, folder)]
    return _svg(lines)


def _printed(command: str, folder: str) -> list[str]:
    _, *words = shlex.split(command)
    environment = {**os.environ, "FORCE_COLOR": "1", "NO_COLOR": "", "PYTHONPATH": str(_ROOT)}
    done = subprocess.run(
        [sys.executable, "-m", "idlc", *words],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
        check=False,
    )
    return done.stdout.rstrip("\n").splitlines()


def _svg(lines: list[str]) -> str:
    columns = max(len(_CODE.sub("", line)) for line in lines)
    width = round(columns * _WIDTH + 2 * _EDGE)
    height = len(lines) * _HEIGHT + 2 * _EDGE
    texts = [
        f'<text x="{_EDGE}" y="{_EDGE + _SIZE + number * _HEIGHT}" xml:space="preserve" '
        f'textLength="{len(_CODE.sub("", line)) * _WIDTH:.0f}">{_spans(line)}</text>'
        for number, line in enumerate(lines)
        if line
    ]
    size = f'width="{width}" height="{height}" viewBox="0 0 {width} {height}"'
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" {size}>',
            f"<style>{_STYLE}\n</style>",
            '<rect class="box" width="100%" height="100%" rx="8"/>',
            *texts,
            "</svg>\n",
        ]
    )


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
