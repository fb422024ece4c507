"""When a run may be left out: idlc's own files count, wherever they stand."""

import json
import os
import shutil
from contextlib import suppress
from pathlib import Path

import pytest

from idlc.diagnostics.report import Report, ReportedError
from idlc.generate import package as generated
from idlc.generate.package import Generated
from idlc.project.root import Root
from idlc.project.settings import Scope
from idlc.project.step import digest
from idlc.tasks.gen import GenOptions, gen

PACKAGE = Path(generated.__file__).parents[1]
MAKERS = [path for path in generated._MAKERS if path.is_dir()]
FOLDERS = [
    folder.relative_to(maker.parent)
    for maker in MAKERS
    for folder in (maker, *maker.rglob("*"))
    if folder.is_dir() and any(path.suffix in (".py", ".jinja") for path in folder.iterdir())
]


def test_the_rooms_that_count_exist():
    assert all((PACKAGE / room).is_dir() for room in generated._ROOMS)


@pytest.mark.parametrize("folder", FOLDERS, ids=str)
def test_a_change_anywhere_in_idlc_counts(folder, tmp_path, monkeypatch):
    for maker in MAKERS:
        shutil.copytree(maker, tmp_path / maker.name, dirs_exist_ok=True)
    monkeypatch.setattr(generated, "_MAKERS", [tmp_path / maker.name for maker in MAKERS])
    generated._newest_maker.cache_clear()
    before = generated._newest_maker()
    file = next(path for path in (tmp_path / folder).iterdir() if path.is_file())
    os.utime(file, ns=(before + 1, before + 1))
    generated._newest_maker.cache_clear()
    assert generated._newest_maker() == before + 1
    generated._newest_maker.cache_clear()


def written(folder: Path, package: str) -> tuple[int, list[str]]:
    """Compile one of two packages; return how many files were written, and what was reported."""
    report = Report()
    options = GenOptions(
        (str(folder / package),), Scope(Root.here(), package), str(folder / "out" / package)
    )
    done: tuple[Generated, ...] = ()
    with suppress(ReportedError):
        done = gen(options, report)
    return sum(one.written for one in done), [found.code for found in report]


@pytest.fixture
def both(tmp_path):
    """The folder of two packages with the same support code, compiled in this process."""
    for package in ("a_msgs", "b_msgs"):
        (tmp_path / package / "msg").mkdir(parents=True)
        (tmp_path / package / "msg" / "A.msg").write_text("int32 a\n")
        assert written(tmp_path, package)[0]
        assert written(tmp_path, package) == (0, [])
    return tmp_path


@pytest.mark.parametrize("path", ["_idlc/message.py", "_type_data.py", "msg/_a.py"])
def test_an_edit_of_the_same_size_and_time_is_seen(both, path):
    edited = both / "out" / "b_msgs" / path
    status, content = edited.stat(), edited.read_bytes()
    edited.write_bytes(content[:-2] + b"#\n")
    os.utime(edited, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert edited.stat().st_size == status.st_size
    assert written(both, "b_msgs") == (0, ["IDL613"])
    assert written(both, "a_msgs") == (0, [])
    edited.write_bytes(content)
    assert written(both, "b_msgs") == (0, [])


@pytest.mark.parametrize("change", ["another file", "one file more", "one file less"])
def test_a_copy_of_the_runtime_by_another_idlc_is_replaced(both, change):
    """Versions between two releases have one number, and theirs may be the newer lock."""
    out = both / "out" / "b_msgs"
    before = {path: path.read_bytes() for path in out.rglob("*.py")}
    record = json.loads((out / "idlc.lock").read_text())
    if change == "one file less":
        (out / "_idlc/cdr.py").unlink()
        del record["outputs"]["_idlc/cdr.py"]
    else:
        path = "_idlc/cdr.py" if change == "another file" else "_idlc/older.py"
        (out / path).write_text("# of another idlc\n")
        record["outputs"][path] = digest(b"# of another idlc\n")
    (out / "idlc.lock").write_text(json.dumps(record))
    done, problems = written(both, "b_msgs")
    assert problems == []
    assert done > 0 or change == "one file more"
    assert {path: path.read_bytes() for path in out.rglob("*.py")} == before


def test_other_line_ends_are_no_edit(both):
    for path in ("_idlc/message.py", "msg/_a.py"):
        file = both / "out" / "b_msgs" / path
        file.write_bytes(file.read_bytes().replace(b"\n", b"\r\n"))
    for package in ("b_msgs", "a_msgs", "b_msgs"):
        assert written(both, package) == (0, [])
