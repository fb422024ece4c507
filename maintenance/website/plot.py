"""The plot of docs/first-plot.md: what its programs make, one after the other, in an empty folder.

`IDLC_REFRESH=docs/pictures pytest tests/website` draws it again.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

_ROOT = Path(__file__).parents[2]
PAGE = _ROOT / "docs/first-plot.md"
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


def plotted(folder: Path) -> Path:
    """Return the picture that the programs of the page make in an empty folder."""
    (folder / "matplotlibrc").write_text(_STYLE, encoding="utf-8")
    text = PAGE.read_text("utf-8")
    for name, block in re.findall(r"^```(\S+\.\w+)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(block, encoding="utf-8")
    (command,) = re.findall(r"^idlc (gen .*)$", text, re.MULTILINE)
    path = os.pathsep.join(filter(None, [str(_ROOT), os.environ.get("PYTHONPATH", "")]))
    environment = {**os.environ, "PYTHONPATH": path, "MPLBACKEND": "agg"}
    for words in (["-m", "idlc", *command.split()], ["record.py"], ["plot.py"]):
        subprocess.run([sys.executable, *words], check=True, cwd=folder, env=environment)
    return folder / "wheels.png"
