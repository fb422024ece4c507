"""The pictures in docs/pictures are what commands print."""

import re

import pytest

from tests.support import refresh
from tests.support.paths import DOCS
from website.pictures import SCENES, picture

FOLDER = DOCS / "pictures"


@pytest.mark.parametrize("name", SCENES)
def test_a_picture_shows_what_is_printed(name):
    path = FOLDER / f"{name}.svg"
    current = picture(SCENES[name])
    if refresh.wanted("docs/pictures"):
        path.write_text(current, encoding="utf-8")
        refresh.refreshed()
    assert path.read_text(encoding="utf-8") == current


def test_pictures_are_small_and_used_and_load_nothing():
    text = "".join(path.read_text(encoding="utf-8") for path in DOCS.rglob("*.md"))
    for path in FOLDER.iterdir():
        assert f"](pictures/{path.name})" in text
        assert path.stat().st_size < 100_000
        assert path.suffix != ".svg" or not re.search(r"url\(|href|<script", path.read_text())
    shown = re.findall(r"!\[([^\]]*)\]\(", text)
    assert len(shown) > 3
    assert all(shown), "who does not see a picture reads what it shows"
