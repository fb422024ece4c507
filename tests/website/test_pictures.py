"""The pictures in docs/pictures are what commands print, and what a program plots."""

import re
import sys

import pytest

from benchmarks import results
from maintenance.website.chart import chart, fields_chart
from maintenance.website.pictures import SCENES, picture
from maintenance.website.plot import PAGE, plotted
from tests.support import programs, refresh
from tests.support.paths import DOCS, ROOT

FOLDER = DOCS / "pictures"


@pytest.mark.parametrize("name", SCENES)
def test_a_picture_shows_what_is_printed(name):
    holds(FOLDER / f"{name}.svg", picture(SCENES[name]))


def test_the_chart_shows_the_kept_run():
    holds(FOLDER / "speed.svg", chart(results.load()))


def test_the_chart_of_fields_shows_the_kept_run():
    holds(FOLDER / "fields.svg", fields_chart(results.load()))


def test_the_chart_has_losses():
    drawn = chart(results.load())
    assert "times faster" in drawn
    assert "times slower" in drawn


def holds(path, current):
    """Compare a picture with what it should be, or write it."""
    if refresh.wanted("docs/pictures"):
        path.write_text(current, encoding="utf-8")
        refresh.refreshed()
    assert path.read_text(encoding="utf-8") == current


def test_the_plot_is_what_the_programs_make(tmp_path, monkeypatch):
    from matplotlib import image

    made, path = plotted(tmp_path), FOLDER / "wheels.png"
    if refresh.wanted("docs/pictures"):
        path.write_bytes(made.read_bytes())
        refresh.refreshed()
    drawn, kept = image.imread(made), image.imread(path)
    assert drawn.shape == kept.shape
    # letters are not drawn alike by all versions
    assert abs(drawn - kept).mean() < 0.02
    examples = re.findall(r"(?ms)^```console\n\$ idlc (.*?)\n(.*?)^```$", PAGE.read_text("utf-8"))
    assert len(examples) == 2
    monkeypatch.setenv("COLUMNS", "88")
    for command, shown in examples:
        words = [sys.executable, "-m", "idlc", *command.split()]
        assert programs.run(*words, cwd=tmp_path) == shown


def test_pictures_are_small_and_used_and_load_nothing():
    pages = [ROOT / "README.md", *DOCS.rglob("*.md")]
    text = "".join(path.read_text(encoding="utf-8") for path in pages)
    for path in FOLDER.iterdir():
        assert f"pictures/{path.name})" in text
        assert path.stat().st_size < 100_000
        assert path.suffix != ".svg" or not re.search(r"url\(|href|<script", path.read_text())
    shown = re.findall(r"!\[([^\]]*)\]\(", text)
    assert len(shown) > 3
    assert all(shown), "a picture without words for readers who do not see it"
