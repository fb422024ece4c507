"""The pictures in docs/pictures are what commands print, and what a program plots."""

import re

import pytest
from matplotlib import image

from maintenance.website.pictures import SCENES, picture
from maintenance.website.plot import plotted, program
from tests.support import refresh
from tests.support.paths import DOCS

FOLDER = DOCS / "pictures"


@pytest.mark.parametrize("name", SCENES)
def test_a_picture_shows_what_is_printed(name):
    path = FOLDER / f"{name}.svg"
    current = picture(SCENES[name])
    if refresh.wanted("docs/pictures"):
        path.write_text(current, encoding="utf-8")
        refresh.refreshed()
    assert path.read_text(encoding="utf-8") == current


def test_the_plot_is_what_the_program_makes(tmp_path):
    made, path = plotted(tmp_path), FOLDER / "wheels.png"
    assert made.name == path.name
    if refresh.wanted("docs/pictures"):
        path.write_bytes(made.read_bytes())
        refresh.refreshed()
    found, kept = image.imread(made), image.imread(path)
    assert found.shape == kept.shape
    # letters are not drawn alike by all versions
    assert abs(found - kept).mean() < 0.02


def test_the_plot_is_made_in_ten_lines():
    assert len(program().splitlines()) <= 10


def test_pictures_are_small_and_used_and_load_nothing():
    text = "".join(path.read_text(encoding="utf-8") for path in DOCS.rglob("*.md"))
    for path in FOLDER.iterdir():
        assert f"](pictures/{path.name})" in text
        assert path.stat().st_size < 100_000
        assert path.suffix != ".svg" or not re.search(r"url\(|href|<script", path.read_text())
    shown = re.findall(r"!\[([^\]]*)\]\(", text)
    assert len(shown) > 3
    assert all(shown), "who does not see a picture reads what it shows"
