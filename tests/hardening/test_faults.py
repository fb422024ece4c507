"""Whatever happens to a run: each file is whole, a failed run changes nothing, the next one works.

The faults are real where they can be (a process that is killed, a kernel that refuses, another
user) and are committed at every write that a run makes, found by Python's audit events.
"""

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import time

import pytest

from idlc.diagnostics.report import Report
from idlc.project.lock import load_lock
from tests.support.machine import GEN, another_user, running, tree
from tests.support.rounds import ALL
from tests.support.waiting import read_line

OLD = {"msg/A.msg": "int8 a\n", "srv/Gone.srv": "---\n", "msg/B.msg": "int8 b\n"}
NEWEST = {"msg/A.msg": "int32 a\n", "msg/C.msg": "A a\n", "srv/Gone.srv": "int8 a\n---\n"}
NEW = {"msg/A.msg": "int16 a\n", "action/Come.action": "---\n---\n", "msg/B.msg": "int8 b\n"}


@pytest.fixture(scope="module")
def machine():
    with running() as found:
        yield found


@pytest.fixture(scope="module")
def versions(machine, tmp_path_factory):
    """Return the folders of the old and the new output as they should be."""
    folder = tmp_path_factory.mktemp("versions")
    for name, files in (("old", OLD), ("new", NEW)):
        machine.reset(None)
        machine.write(files)
        assert machine.run()["status"] == 0
        shutil.copytree(machine.folder / "out", folder / name)
    return folder / "old", folder / "new"


@pytest.fixture(params=["first run", "next run", "forced run"])
def before(request, machine, versions):
    """Return the words to run, and the output before the run; new interfaces wait for it."""
    machine.write(NEW)
    if request.param == "first run":
        return GEN, None
    if request.param == "next run":
        return GEN, versions[0]
    edited = versions[0].parent / "edited"
    shutil.copytree(versions[0], edited, dirs_exist_ok=True)
    (edited / "demo/msg/_a.py").write_text("mine\n", encoding="utf-8")
    return [*GEN, "--force"], edited


def assert_new(machine, versions):
    found = {path: data for path, data in machine.tree.items() if ".bak" not in path}
    assert found == tree(versions[1])
    assert not list((machine.folder / "out").rglob(".idlc-stage-*"))


@pytest.mark.long
@pytest.mark.parametrize("torn", [False, True], ids=["before", "while"])
def test_killed_at_any_write(torn, before, machine, versions):
    words, start = before
    old, new = tree(start) if start else {}, tree(versions[1])
    machine.reset(start)
    points = machine.run(words)["points"]
    assert points > 10
    # on a first run, most writes are alike: the files that support the others
    few = {*range(1, 6), *range(6, points - 12, 9), *range(max(points - 12, 1), points + 1)}
    for point in range(1, points + 1) if len(new) < 10 or start else sorted(few):
        machine.reset(start)
        assert machine.run(words, point=point, torn=torn)["status"] == -signal.SIGKILL
        for path, data in (machine.tree if (machine.folder / "out").exists() else {}).items():
            if path.endswith(".bak"):
                assert data in (b"mine\n", b"", b"to")
            elif path.endswith("idlc.lock"):
                assert load_lock(machine.folder / "out/demo", "demo", Report())
            else:
                assert data in (old.get(path), new.get(path)), f"{path} at write {point}"
        again = machine.run(words)
        assert again["status"] == 0, f"after write {point}: {again['said']}"
        assert_new(machine, versions)
        if "--force" in words:
            kept = [data for path, data in machine.tree.items() if ".bak" in path]
            assert b"mine\n" in kept, f"the edit is lost after write {point}"


@pytest.mark.long
def test_killed_at_any_write_and_the_interfaces_changed_since(before, machine, versions):
    """Not even the drafts are there, as after `git clean`; the lock has all that is needed."""
    words, start = before
    machine.write(NEWEST)
    machine.reset(None)
    assert machine.run()["status"] == 0
    newest = machine.tree
    machine.write(NEW)
    machine.reset(start)
    points = machine.run(words)["points"]
    for point in range(1, points + 1, 2 if start else 13):
        machine.write(NEW)
        machine.reset(start)
        assert machine.run(words, point=point, torn=True)["status"] == -signal.SIGKILL
        for stage in machine.folder.rglob(".idlc-stage-*"):
            shutil.rmtree(stage)
        machine.write(NEWEST)
        again = machine.run(words)
        assert again["status"] == 0, f"after write {point}: {again['said']}"
        files = {path: data for path, data in machine.tree.items() if ".bak" not in path}
        assert files == newest
        kept = [data for path, data in machine.tree.items() if ".bak" in path]
        assert b"mine\n" in kept or "--force" not in words


OTHERS = [
    pytest.param(number, marks=pytest.mark.long)
    for number in (errno.EACCES, errno.EROFS, errno.EIO)
]


@pytest.mark.parametrize("number", [errno.ENOSPC, *OTHERS])
def test_every_write_from_some_point_on_fails(number, before, machine, versions):
    words, start = before
    old, new = tree(start) if start else {}, tree(versions[1])
    machine.reset(start)
    points = machine.run(words)["points"]
    step = 1 if start and number == errno.ENOSPC else 7
    for point in range(1, points + 1, step):
        machine.reset(start)
        found = machine.run(words, point=point, error=number)
        if found["status"] == 0:  # only tidying up was left
            now = {path: data for path, data in machine.tree.items() if ".bak" not in path}
            assert now == new
            continue
        assert found["status"] == 2, found["said"]
        assert "IDL612" in found["said"]
        assert os.strerror(number).lower() in found["said"].lower()
        now = machine.tree if (machine.folder / "out").exists() else {}
        if "no file in `out/demo` was changed" in found["said"]:
            assert now == old, f"write {point}"
        elif "restoring the old files failed, too" in found["said"]:
            for path, data in now.items():
                known = (old.get(path), new.get(path))
                assert data in known or path.endswith("idlc.lock") or ".bak" in path
        else:
            assert "cannot write `out/demo`" in found["said"]
            assert now == old
        again = machine.run(words)
        assert again["status"] == 0, again["said"]
        assert_new(machine, versions)


@pytest.mark.parametrize("size", [0, 1000, 5_000])
def test_a_disk_that_takes_only_part_of_a_file(size, before, machine, versions):
    words, start = before
    machine.reset(start)
    found = machine.run(words, size=size)
    assert found["status"] == 2
    assert "file too large" in found["said"]
    assert "no file in `out/demo` was changed" in found["said"]
    assert (machine.tree if (machine.folder / "out").exists() else {}) == (
        tree(start) if start else {}
    )
    assert machine.run(words)["status"] == 0
    assert_new(machine, versions)


@pytest.mark.long
@pytest.mark.parametrize("where", ["out", "out/demo", "out/demo/msg", "pkg"])
def test_folders_removed_meanwhile(where, machine, versions):
    machine.write(NEW)
    machine.reset(versions[0])
    points = machine.run()["points"]
    for point in range(1, points + 1):
        machine.write(NEW)
        machine.reset(versions[0])
        found = machine.run(point=point, remove=where)
        assert found["status"] in (0, 2), found["said"]
        assert found["status"] == 0 or "IDL612" in found["said"]
        for path, data in (machine.tree if (machine.folder / "out").exists() else {}).items():
            known = (tree(versions[0]).get(path), tree(versions[1]).get(path))
            assert data in known or path.endswith("idlc.lock"), path
        machine.write(NEW)
        again = machine.run()
        assert again["status"] == 0, f"{point}: {again['said']}"
        assert_new(machine, versions)


@pytest.mark.parametrize("mode", ["read-only files", "read-only folders", "no access", "another's"])
def test_without_permission(mode, machine, versions):
    other = another_user(machine.folder)
    if not other and mode == "another's":
        return  # what is another's cannot be made without being root; the modes say the same
    machine.write(NEW)
    machine.reset(versions[0])
    out = machine.folder / "out"
    folders = [out, *(path for path in out.rglob("*") if path.is_dir())]
    files = [path for path in out.rglob("*") if path.is_file()]
    if other and mode != "another's":
        for path in (*folders, *files):
            os.chown(path, 65534, 65534)
    if mode == "read-only files":
        for path in files:
            path.chmod(0o444)
    else:
        for path in reversed(folders):  # who is not root must do the inner ones first
            path.chmod(0o000 if mode == "no access" else 0o555)
    try:
        found = machine.run(**other)
    finally:
        for path in (*folders, *files):
            if path.exists():
                path.chmod(0o755 if path in folders else 0o644)
    if mode == "read-only files":  # what counts is the folder: idlc never writes into a file
        assert found["status"] == 0, found["said"]
        assert_new(machine, versions)
        return
    assert found["status"] in (1, 2), found["said"]
    assert "permission denied" in found["said"]
    assert "Traceback" not in found["said"]
    assert machine.tree == tree(versions[0])
    assert machine.run()["status"] == 0
    assert_new(machine, versions)


@pytest.mark.parametrize(
    "path", ["msg", "msg/_a.py", "idlc.lock", "_idlc", "action", "msg/_new.py"]
)
def test_links_that_point_outside(path, machine, versions):
    machine.write({**NEW, "msg/New.msg": "int8 x\n"} if "new" in path else NEW)
    machine.reset(versions[0])
    outside = machine.folder / "outside"
    shutil.rmtree(outside, ignore_errors=True)
    outside.mkdir()
    (outside / "precious").write_text("precious\n", encoding="utf-8")
    link = machine.folder / "out/demo" / path
    if link.is_dir():
        shutil.rmtree(link)
    link.unlink(missing_ok=True)
    link.symlink_to(outside / "precious" if "." in path else outside)
    for words in (GEN, [*GEN, "--force"]):
        found = machine.run(words)
        assert found["status"] in (1, 2), found["said"]
        assert link.is_symlink()
        assert tree(outside) == {"precious": b"precious\n"}


def test_a_clock_that_goes_back(machine, versions):
    for time_of_lock in (0, time.time() + 10**6):
        machine.write(OLD)
        machine.reset(versions[0])
        os.utime(machine.folder / "out/demo/idlc.lock", (time_of_lock, time_of_lock))
        machine.write(NEW)
        for path in (machine.folder / "pkg").rglob("*"):
            os.utime(path, (1, 1))
        assert machine.run()["status"] == 0
        assert_new(machine, versions)


def test_a_staging_folder_whose_number_is_in_use_again(machine, versions):
    machine.write(NEW)
    machine.reset(versions[0])
    stage = machine.folder / f"out/demo/.idlc-stage-{os.getpid()}"
    stage.mkdir()
    shutil.copy(versions[1] / "demo/idlc.lock", stage)
    assert machine.run()["status"] == 0
    assert machine.tree == tree(versions[1])


def test_a_run_with_nothing_to_do_sweeps_what_a_killed_one_left(machine, versions):
    machine.write(OLD)
    machine.reset(versions[0])
    stage = machine.folder / "out/demo/.idlc-stage-4194305"
    stage.mkdir()
    (stage / "0").write_text("x", encoding="utf-8")
    assert "unchanged" in machine.run()["said"]
    assert not stage.exists()


def test_two_runs_at_once(machine, versions, tmp_path):
    """Two versions are written to one folder again and again; one of them is there in the end."""
    machine.reset(None)
    sources = {}
    for name, files in (("old", OLD), ("new", NEW)):
        machine.write(files)
        sources[name] = tmp_path / name / "pkg"
        shutil.copytree(machine.folder / "pkg", sources[name])
    loop = (
        "import contextlib, io, sys\nfrom idlc.cli.main import main\n"
        "for _ in range(25):\n"
        "    out = io.StringIO()\n"
        "    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):\n"
        "        status = main(['gen', sys.argv[1], '-o', sys.argv[2]])\n"
        "    assert status == 0, out.getvalue()\n"
    )
    out = tmp_path / "out" / "demo"
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", loop, str(source), str(out)],
            stderr=subprocess.PIPE,
            text=True,
        )
        for source in sources.values()
    ]
    for run in runs:
        _, said = run.communicate()
        assert run.returncode == 0, said[-1500:]
    assert tree(out.parent) in (tree(versions[0]), tree(versions[1]))
    assert not list(out.rglob(".idlc-stage-*"))


@pytest.mark.parametrize("options", [[], ["--vendor-deps"], ["--vendor-deps=beside"]])
def test_a_run_waits_for_one_that_is_making_the_folders(options, tmp_path):
    """The first made `out/demo` and nothing in it; the second must see all of it or nothing."""
    slow = (
        "import sys\nfrom pathlib import Path\nfrom idlc.cli.main import main\n"
        "real = Path.mkdir\n"
        "def mkdir(path, *args, **kwargs):\n"
        "    real(path, *args, **kwargs)\n"
        "    if path.name == 'demo':\n"
        "        print('made', flush=True)\n"
        "        sys.stdin.readline()\n"
        "Path.mkdir = mkdir\n"
        "sys.exit(main(sys.argv[1:]))\n"
    )
    runs = []
    for name, kind in (("first", "int8"), ("second", "int16")):
        path = tmp_path / name / "demo/msg/A.msg"
        path.parent.mkdir(parents=True)
        path.write_text(f"{kind} a\n", encoding="utf-8")
        code = ["-c", slow] if name == "first" else ["-m", "idlc"]
        words = [sys.executable, *code, "gen", f"{name}/demo", "-o", "out/demo", *options]
        runs.append(
            subprocess.Popen(
                words,
                cwd=tmp_path,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
            )
        )
        if name == "first":
            assert read_line(runs[0].stdout) == "made\n"
    with pytest.raises(subprocess.TimeoutExpired):
        runs[1].wait(1)
    for run in runs:
        said, _ = run.communicate("\n")
        assert run.returncode == 0, said
    assert "int16" in (tmp_path / "out/demo/msg/_a.py").read_text(encoding="utf-8")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_during_the_moves_waits_until_they_are_made(number, tmp_path):
    (tmp_path / "pkg/msg").mkdir(parents=True)
    (tmp_path / "pkg/msg/A.msg").write_text("int8 a\n", encoding="utf-8")
    code = (
        "import os, sys\nfrom idlc.cli.main import main\n"
        "real = os.replace\n"
        "def replace(path, target):\n"
        f"    os.kill(os.getpid(), {int(number)})\n"
        "    return real(path, target)\n"
        "os.replace = replace\n"
        "sys.exit(main(['gen', 'pkg', '-o', 'out/demo']))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=False)
    assert done.returncode in (-number, 130)
    if number == signal.SIGINT:  # Python has a say in this one, and takes everything back
        assert not (tmp_path / "out").exists()
        return
    lock = json.loads((tmp_path / "out/demo/idlc.lock").read_text(encoding="utf-8"))
    assert set(lock["outputs"]) <= set(tree(tmp_path / "out/demo"))


@pytest.mark.rounds
@pytest.mark.parametrize("fault", [{}, {"torn": True}, {"error": errno.ENOSPC}], ids=str)
def test_fmt_killed_or_refused_at_any_write_leaves_the_file_whole(fault, machine):
    words = ["fmt", "pkg"]
    old, new = b"int8   a\n", b"int8 a\n"
    for point in range(1, 20, 1 if ALL else 3):
        machine.write({"msg/A.msg": old.decode()})
        outcome = machine.run(words, point=point, **fault)
        data = (machine.folder / "pkg/msg/A.msg").read_bytes()
        assert data in (old, new), point
        if outcome["status"] == 0:
            assert data == new
            break
    assert 2 < point < 19
