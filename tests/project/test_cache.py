"""What idlc keeps between runs: compiled templates, only where nobody else can write."""

import os
import shutil
import stat
import subprocess
import sys

import pytest

from idlc.project.files import cache_folder

WITH_CACHE = {"PYTHONDONTWRITEBYTECODE": ""}


def gen(folder, **environment):
    (folder / "in").mkdir(exist_ok=True)
    (folder / "in/Point.msg").write_text("float64 x\n")
    words = ["gen", "in", "-o", "out/points", "--package", "points", "--force"]
    subprocess.run(
        [sys.executable, "-m", "idlc", *words],
        cwd=folder,
        env={**os.environ, **environment},
        check=True,
        stdout=subprocess.PIPE,
    )
    written = (folder / "out").rglob("*.py")
    return {path.relative_to(folder): path.read_text() for path in written}


def test_templates_are_compiled_once(tmp_path):
    home = {"XDG_CACHE_HOME": str(tmp_path / "cache"), **WITH_CACHE}
    first = gen(tmp_path, **home)
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "cache/idlc").iterdir()}
    assert any(path.name.startswith("template-") for path in kept)
    shutil.rmtree(tmp_path / "out")
    assert gen(tmp_path, **home) == first
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "cache/idlc").iterdir()} == kept


@pytest.mark.parametrize("rest", [0, 20, -9])
def test_a_damaged_file_is_made_again(tmp_path, rest):
    home = {"XDG_CACHE_HOME": str(tmp_path / "cache"), **WITH_CACHE}
    first = gen(tmp_path, **home)
    for path in (tmp_path / "cache/idlc").iterdir():
        path.write_bytes(path.read_bytes()[:rest])
    shutil.rmtree(tmp_path / "out")
    assert gen(tmp_path, **home) == first


def test_no_cache_where_others_can_write(tmp_path, monkeypatch):
    (tmp_path / "idlc").mkdir(mode=0o700)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder.__wrapped__() == tmp_path / "idlc"
    (tmp_path / "idlc").chmod(0o777)
    assert cache_folder.__wrapped__() is None


def test_no_cache_in_a_home_of_somebody_else(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home/.cache"))
    monkeypatch.setattr(os, "getuid", lambda: tmp_path.stat().st_uid + 1)
    assert cache_folder.__wrapped__() is None
    assert not (tmp_path / "home").exists()


def test_the_folder_is_private(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert stat.S_IMODE(cache_folder.__wrapped__().stat().st_mode) == 0o700


def test_without_a_place_for_a_cache_all_works(tmp_path):
    (tmp_path / "file").write_text("")
    gen(tmp_path, XDG_CACHE_HOME=str(tmp_path / "file"), **WITH_CACHE)
    assert (tmp_path / "file").read_text() == ""
