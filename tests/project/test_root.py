"""A root is all that a check knows of the folder that it runs in."""

import os
import threading
from pathlib import Path

import pytest

from idlc.diagnostics.report import Report
from idlc.project.root import Root
from idlc.project.settings import load_settings, scope
from idlc.tasks.check import CheckOptions, check
from tests.support.waiting import LIMIT, join

COUNT = 20


def problems(folder):
    """Return what `idlc check .` reports in a folder."""
    report = Report()
    settings = load_settings(Root.at(folder), report)
    check(CheckOptions((".",), scope(settings)), report)
    return [(one.code, one.where[0], one.message) for one in report]


def test_two_threads_check_two_folders_with_the_same_paths_in_them(tmp_path):
    for name, text in (("one", "flot64 x\n"), ("two", "Absent x\nint8 y 300\n")):
        for file in ("package.xml", "pyproject.toml", *(f"msg/M{n}.msg" for n in range(COUNT))):
            path = tmp_path / name / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text if file.startswith("msg") else "")
        (tmp_path / name / "package.xml").write_text(f"<package><name>{name}</name></package>")
        (tmp_path / name / "pyproject.toml").write_text(f"[tool.idlc]\nunknown_{name} = 1\n")
    folders = [tmp_path / name for name in ("one", "two")] * 3
    expected = {folder: problems(folder) for folder in folders}
    first, second = expected.values()
    assert len(first) > COUNT
    assert first != second
    assert {path for _, path, _ in first} == {path for _, path, _ in second}
    together = threading.Barrier(len(folders))
    results = []

    def run(folder):
        together.wait(LIMIT)
        results.append((folder, problems(folder)))

    threads = [threading.Thread(target=run, args=[folder]) for folder in folders]
    for thread in threads:
        thread.start()
    join(*threads)
    assert len(results) == len(folders)
    assert all(result == expected[folder] for folder, result in results)


def test_paths_are_shown_from_the_base(tmp_path):
    root = Root(tmp_path / "a")
    assert root.shown(tmp_path / "a/msg/A.msg") == "msg/A.msg"
    assert root.shown(tmp_path / "a") == "."
    assert root.shown(tmp_path / "ab/A.msg") == (tmp_path / "ab/A.msg").as_posix()
    assert root.absolute("../b/./A.msg") == tmp_path / "b/A.msg"
    assert root.relative(tmp_path / "b") == str(Path("../b"))


def test_a_folder_that_is_gone_is_no_base(tmp_path):
    (tmp_path / "file").write_text("")
    for name in ("absent", "file"):
        with pytest.raises(OSError, match=name):
            Root.at(tmp_path / name)


def test_the_text_that_is_open_comes_before_the_file(tmp_path):
    path = tmp_path / "A.msg"
    path.write_bytes(b"on disk")
    root = Root(tmp_path, {path: b"open", tmp_path / "New.msg": b""})
    assert root.read_bytes("A.msg", "A.msg", Report()) == b"open"
    assert Root(tmp_path).read_bytes("A.msg", "A.msg", Report()) == b"on disk"
    assert root.is_file(f".{os.sep}New.msg")
    assert list(root.unsaved_below(tmp_path)) == [tmp_path / "New.msg"]
