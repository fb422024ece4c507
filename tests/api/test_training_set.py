"""The programs and commands of docs/training-set.md, in the order of the page."""

import re
import runpy
import shutil
from pathlib import Path

import numpy as np

from idlc.cli.main import main
from tests.support.paths import DOCS

BLOCKS = re.findall(
    r"(?ms)^```(?:(\w+\.py)|console\n\$ (.*?))\n(.*?)^```$",
    (DOCS / "training-set.md").read_text(encoding="utf-8"),
)


def test_programs_and_commands_print_what_the_page_shows(here, capfd):
    for program, _, text in BLOCKS:
        if program:
            (here / program).write_text(text, encoding="utf-8")
    runpy.run_path("record.py")
    Path("bags").mkdir()
    shutil.copy("robot.mcap", "bags/monday.mcap")
    Path("bags/tuesday.mcap").write_text("no recording", encoding="utf-8")
    for _, command, shown in BLOCKS:
        tool, *words = command.split() or [""]
        if tool == "python":
            runpy.run_path(words[0], run_name="__main__")
        elif tool:
            assert main(words) == 0
        assert not tool or capfd.readouterr().out == shown
    runpy.run_path("pictures.py")
    lines = Path("labels.csv").read_text(encoding="utf-8").splitlines()
    names, speeds = zip(*(line.split(",") for line in lines), strict=True)
    assert names[1:] == tuple(f"images/{number:06}.png" for number in range(1, 51))
    np.testing.assert_allclose(np.array(speeds[1:], float), 0.002 + np.arange(50) * 0.01)
    assert len(list(here.glob("images/*.png"))) == 50
    with np.load("train.npz") as train:
        assert train["images"][20, 0, :, 0].argmax() == int(3 * 2.04)
    assert {path.name for path in here.glob("tables/*")} == {"monday.parquet", "manifest.json"}
