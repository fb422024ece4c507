"""The faults of test_faults.py, committed against the other commands that write.

`fmt` and `check --fix` promise that each file is whole, `scaffold` and `docs` besides that all
files are new or none is.
"""

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
from typing import NamedTuple

import pytest

from idlc.tasks.docs import LISTING
from tests.support.machine import another_user, running, tree

pytestmark = pytest.mark.long

PACKAGE = {
    "package.xml": "<?xml version='1.0'?>\n<package format='3'>\n  <name>pkg</name>\n</package>\n",
    "setup.py": "from setuptools import setup\n\nsetup(\n    name='pkg',\n    data_files=[],\n)\n",
    "msg/A.msg": "int8   a\nint8    b # [m]\n",
    "msg/B.msg": "int8  a\n",
}


class Command(NamedTuple):
    """Words for idlc, the files that they work on, and whether it is all of them or none.

    `after` are words that make `work` first.
    """

    words: tuple[str, ...]
    at_once: bool
    cwd: str = ""
    files: dict[str, str] = PACKAGE
    after: tuple[str, ...] = ()


COMMANDS = {
    "fmt": Command(("fmt", "work"), at_once=False),
    "check --fix": Command(
        ("check", "work", "--fix", "--select", "char-type"),
        at_once=False,
        files={"msg/A.msg": "char a\nchar b\n", "msg/B.msg": "char a\n"},
    ),
    "scaffold interface": Command(
        ("scaffold", "interface", "msg", "New", "geometry_msgs/Point p"),
        at_once=True,
        cwd="work",
    ),
    "scaffold package": Command(("scaffold", "package", "work"), at_once=True, files={}),
    "scaffold node": Command(
        ("scaffold", "node", "talker", "--publisher", "geometry_msgs/Point:at"),
        at_once=True,
        cwd="work",
        after=("scaffold", "package", "work"),
    ),
    "docs": Command(("docs", "pages", "-o", "work"), at_once=True, files={}),
    "docs again": Command(
        ("docs", "pages", "-o", "work"), at_once=True, after=("docs", "pages", "-o", "work")
    ),
}
PAGES = {"pages/msg/A.msg": "int8 a\n", "pages/msg/C.msg": "A a\n"}
EARLIER = {"pages/msg/A.msg": "int16 a  # x\n", "pages/msg/B.msg": "A a\n"}


def lay(folder, files):
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")


class Scene:
    """A command, and the folder `work` before and after it."""

    def __init__(self, name, machine):
        self.machine, self.command = machine, COMMANDS[name]
        self.work = machine.folder / "work"
        self.start = machine.folder / "start"
        shutil.rmtree(self.start, ignore_errors=True)
        self.start.mkdir()
        if self.command.after:
            self.pages(EARLIER)
            shutil.rmtree(self.work, ignore_errors=True)
            assert self.machine.run(self.command.after)["status"] == 0
            shutil.copytree(self.work, self.start, dirs_exist_ok=True)
        else:
            lay(self.start, self.command.files)
        self.pages(PAGES)
        self.reset()
        done = self.run()
        assert done["status"] in (0, 1), done["said"]
        self.status, self.points = done["status"], done["points"]
        self.old, self.new = whole(self.start), whole(self.work)
        assert self.old != self.new
        assert self.points > 2

    def pages(self, files):
        shutil.rmtree(self.machine.folder / "pages", ignore_errors=True)
        lay(self.machine.folder, files)

    def reset(self):
        shutil.rmtree(self.work, ignore_errors=True)
        if any(self.start.iterdir()):
            shutil.copytree(self.start, self.work)

    def run(self, **fault):
        return self.machine.run(self.command.words, cwd=self.command.cwd, **fault)

    @property
    def now(self):
        return whole(self.work) if self.work.exists() else {}

    def assert_whole(self, why, *, lost=False):
        """Assert that each file is old or new, or the record of both; and there, unless `lost`."""
        for path, data in self.now.items():
            known = (self.old.get(path), self.new.get(path))
            assert data in known or path == LISTING, f"{path}: {why}"
        for path in self.old.keys() & self.new.keys() if not lost else ():
            assert path in self.now, f"{path} is lost: {why}"


def whole(folder):
    """Return the files of a folder, without drafts that only a killed run leaves behind."""
    return {path: data for path, data in tree(folder).items() if "/." not in f"/{path}"}


@pytest.fixture(scope="module")
def machine():
    with running() as found:
        yield found


@pytest.fixture(params=COMMANDS)
def scene(request, machine):
    return Scene(request.param, machine)


@pytest.mark.parametrize("torn", [False, True], ids=["before", "while"])
def test_killed_at_any_write(torn, scene):
    for point in range(1, scene.points + 1):
        scene.reset()
        assert scene.run(point=point, torn=torn)["status"] == -signal.SIGKILL
        scene.assert_whole(f"killed at write {point}")
        again = scene.run()
        assert again["status"] == scene.status, f"after write {point}: {again['said']}"
        assert scene.now == scene.new, f"after write {point}"


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EACCES, errno.EROFS])
def test_every_write_from_some_point_on_fails(number, scene):
    for point in range(1, scene.points + 1, 1 if number == errno.ENOSPC else 4):
        scene.reset()
        found = scene.run(point=point, error=number)
        scene.assert_whole(f"write {point} failed")
        if scene.now == scene.new:  # only tidying up was left
            continue
        assert found["status"] == 2, found["said"]
        assert "IDL612" in found["said"]
        assert os.strerror(number).lower() in found["said"].lower()
        if scene.command.at_once and "restoring the old files failed, too" not in found["said"]:
            assert scene.now == scene.old, f"write {point}: {found['said']}"
        assert scene.run()["status"] == scene.status
        assert scene.now == scene.new


def test_a_disk_that_takes_only_part_of_a_file(scene):
    scene.reset()
    found = scene.run(size=3)
    assert found["status"] == 2
    assert "file too large" in found["said"]
    assert scene.now == scene.old


def test_the_folder_is_removed_meanwhile(scene):
    for point in range(1, scene.points + 1):
        scene.reset()
        found = scene.run(point=point, remove="work")
        assert found["status"] in (0, 1, 2), found["said"]
        assert "Traceback" not in found["said"]
        assert "IDL901" not in found["said"]
        scene.assert_whole(f"removed at write {point}", lost=True)


def test_without_permission(scene):
    scene.reset()
    scene.work.mkdir(exist_ok=True)
    other = another_user(scene.machine.folder)
    folders = [scene.work, *(path for path in scene.work.rglob("*") if path.is_dir())]
    for folder in folders:
        folder.chmod(0o555)
    try:
        found = scene.run(**other)
    finally:
        for folder in folders:
            folder.chmod(0o755)
    assert found["status"] == 2, found["said"]
    assert "permission denied" in found["said"]
    assert scene.now == scene.old


def test_links_that_point_outside(scene):
    """A file that is a link keeps to be one; what scaffold and docs write never goes through it."""
    outside = scene.machine.folder / "outside"
    for path in scene.new.keys() - {p for p in scene.new if scene.old.get(p) == scene.new[p]}:
        shutil.rmtree(outside, ignore_errors=True)
        outside.mkdir()
        scene.reset()
        (outside / "precious").write_bytes(scene.old.get(path, b"precious\n"))
        link = scene.work / path
        link.parent.mkdir(parents=True, exist_ok=True)
        link.unlink(missing_ok=True)
        link.symlink_to(outside / "precious")
        found = scene.run()
        assert link.is_symlink(), path
        assert list(outside.iterdir()) == [outside / "precious"]
        kept = (outside / "precious").read_bytes()
        if scene.command.at_once:
            assert kept == scene.old.get(path, b"precious\n"), found["said"]
        else:  # the link leads to the user's file, which was asked for
            assert kept == scene.new[path]


def test_folders_that_are_links_are_not_entered(scene):
    """What is listed as written, added or removed below a link stays."""
    if not scene.command.at_once:
        return  # these write only files that they have found, wherever they are
    outside = scene.machine.folder / "outside"
    for folder in {path.rpartition("/")[0] for path in (scene.old | scene.new)} - {""}:
        scene.reset()
        shutil.rmtree(outside, ignore_errors=True)
        if (scene.work / folder).exists():
            shutil.move(scene.work / folder, outside)
        else:
            outside.mkdir()
        (scene.work / folder).parent.mkdir(parents=True, exist_ok=True)
        (scene.work / folder).symlink_to(outside)
        before = tree(outside)
        scene.run()
        assert tree(outside) == before, folder


def test_two_runs_at_once(scene):
    scene.reset()
    before = scene.machine.folder / scene.command.cwd
    before.mkdir(exist_ok=True)
    code = "import sys\nfrom idlc.cli.main import main\nsys.exit(main(sys.argv[1:]))"
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", code, *scene.command.words],
            cwd=before,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        for _ in range(3)
    ]
    for run in runs:
        said, _ = run.communicate()
        # what a user edits is read before idlc knows where it will write, so it may have changed
        edited = scene.command.words[0] != "docs" and "was changed while idlc was running" in said
        assert run.returncode == scene.status or (run.returncode == 2 and edited), said
    assert scene.now == scene.new
    left = [path for path in scene.work.rglob(".*") if path.name.startswith((".idlc", ".A", ".B"))]
    assert left == []


def test_a_hostile_listing_removes_nothing(tmp_path, monkeypatch):
    from idlc.cli.main import main

    monkeypatch.chdir(tmp_path)
    lay(tmp_path, {**PAGES, "precious": "x", "site/mine": "x", "elsewhere/precious": "x"})
    (tmp_path / "site/link").symlink_to(tmp_path / "elsewhere")
    same = "2d711642b726b04401627ca9fbac32f5c8530fb1903cc4db02258717921a4881"  # of x
    paths = [
        "../precious",
        f"{tmp_path}/precious",
        "link/precious",
        "a\0b",
        "\ud800",
        "",
        ".",
        "//",
    ]
    for listing in (dict.fromkeys(paths, same), paths, {"mine": "?"}, "[" * 100_000, 5):
        text = listing if isinstance(listing, str) else json.dumps(listing)
        (tmp_path / "site/idlc-docs.json").write_text(text, encoding="utf-8")
        main(["docs", "pages", "-o", "site"])
        assert (tmp_path / "precious").read_text("utf-8") == "x"
        assert (tmp_path / "elsewhere/precious").read_text("utf-8") == "x"
        assert (tmp_path / "site/mine").read_text("utf-8") == "x"
