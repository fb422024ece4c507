"""When a run may be left out: idlc's own files count, wherever they stand."""

import os
import shutil
from pathlib import Path

import pytest

from idlc.disk.output import up_to_date

PACKAGE = Path(up_to_date.__file__).parents[2]
MAKERS = [path for path in up_to_date._MAKERS if path.is_dir()]
FOLDERS = [
    folder.relative_to(maker.parent)
    for maker in MAKERS
    for folder in (maker, *maker.rglob("*"))
    if folder.is_dir() and any(path.suffix in (".py", ".jinja") for path in folder.iterdir())
]


@pytest.mark.parametrize("folder", FOLDERS, ids=str)
def test_a_change_anywhere_in_idlc_counts(folder, tmp_path, monkeypatch):
    for maker in MAKERS:
        shutil.copytree(maker, tmp_path / maker.name, dirs_exist_ok=True)
    monkeypatch.setattr(up_to_date, "_MAKERS", [tmp_path / maker.name for maker in MAKERS])
    up_to_date._newest_maker.cache_clear()
    before = up_to_date._newest_maker()
    file = next(path for path in (tmp_path / folder).iterdir() if path.is_file())
    os.utime(file, ns=(before + 1, before + 1))
    up_to_date._newest_maker.cache_clear()
    assert up_to_date._newest_maker() == before + 1
    up_to_date._newest_maker.cache_clear()
