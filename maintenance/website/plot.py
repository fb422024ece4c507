"""The plot of docs/recordings.md: what its program makes of a recording that is made here.

`IDLC_REFRESH=docs/pictures pytest tests/website` makes it anew.
"""

from __future__ import annotations

import math
import os
import re
import struct
import subprocess
import sys
from pathlib import Path

_ROOT = Path(__file__).parents[2]
PAGE = _ROOT / "docs/recordings.md"
#: matplotlib's settings of the folder that it runs in: the colours of the pictures of a terminal.
_STYLE = """\
figure.figsize: 7.2, 2.8
figure.constrained_layout.use: True
savefig.dpi: 110
font.size: 9
lines.linewidth: 1.6
figure.facecolor: 10151c
axes.facecolor: 10151c
axes.edgecolor: 8a97a8
axes.labelcolor: d7dee8
axes.prop_cycle: cycler("color", ["79c0ff", "7ee787", "e3b341", "ff7b72"])
axes.spines.top: False
axes.spines.right: False
axes.grid: True
grid.color: 2a3340
text.color: d7dee8
xtick.color: d7dee8
ytick.color: d7dee8
legend.facecolor: 10151c
legend.edgecolor: 2a3340
date.autoformatter.second: %M:%S
date.autoformatter.microsecond: %M:%S
"""
#: Messages, and when they begin, in nanoseconds.
_COUNT, _START = 200, 1_700_000_000 * 10**9


def program() -> str:
    """Return the program on the page."""
    (found,) = re.findall(
        r"^```python\n(import matplotlib(?:.*\n)*?)```$", PAGE.read_text("utf-8"), re.MULTILINE
    )
    return str(found)


def plotted(folder: Path) -> Path:
    """Return the picture that the program makes in an empty folder."""
    record(folder / "drive.mcap")
    (folder / "matplotlibrc").write_text(_STYLE, encoding="utf-8")
    path = os.pathsep.join(filter(None, [str(_ROOT), os.environ.get("PYTHONPATH", "")]))
    environment = {**os.environ, "PYTHONPATH": path, "MPLBACKEND": "agg"}
    subprocess.run([sys.executable, "-c", program()], check=True, cwd=folder, env=environment)
    (made,) = folder.glob("*.png")
    return made


def record(path: Path) -> None:
    """Record four wheels in a bend."""
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        text = b"float64[4] speed  # forward [m/s]\n"
        schema = writer.register_schema("demo_msgs/msg/Wheels", "ros2msg", text)
        channel = writer.register_channel("/wheels", "cdr", schema)
        for number in range(_COUNT):
            time = _START + number * 50_000_000
            data = b"\0\1\0\0" + struct.pack("<4d", *speeds(number))
            writer.add_message(channel, time, data, time)
        writer.finish()


def speeds(number: int) -> tuple[float, ...]:
    """Return the speeds of the wheels in a message."""
    speed = 1.5 * min(1.0, number / 40, (_COUNT - 1 - number) / 40)
    bend = 0.25 * speed * math.sin(number / 20)
    slip = 0.04 * speed * math.sin(number / 2.5)
    return speed - bend, speed + bend, speed - bend + slip, speed + bend - slip
