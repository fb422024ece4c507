"""The programs and commands of docs/training-set.md, in the order of the page."""

import re
import runpy
import shutil
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow as pa

from idlc.cli.main import main
from tests.support.paths import DOCS

BLOCKS = re.findall(
    r"(?ms)^```(?:(\w+\.py)|console\n\$ (.*?))\n(.*?)^```$",
    (DOCS / "training-set.md").read_text(encoding="utf-8"),
)


def test_programs_and_commands_print_what_the_page_shows(here, capfd, monkeypatch):
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
    lake = {}

    def write_dataset(batches, path, schema):
        lake[path] = pa.Table.from_batches(batches, schema)

    monkeypatch.setitem(sys.modules, "lance", SimpleNamespace(write_dataset=write_dataset))
    runpy.run_path("lake.py")
    assert lake["train.lance"].num_rows == 50
    assert not any("." in name for name in lake["train.lance"].column_names)
