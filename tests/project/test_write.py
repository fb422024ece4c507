"""Writing a package: all or nothing, whatever fails, and never over what is not idlc's own."""

import contextlib
import errno
import os
import pathlib
import sys
from pathlib import Path

import pytest

from idlc.diagnostics.report import Report
from idlc.project import lock, step, write
from idlc.project.lock import load_lock
from idlc.project.write import plan

OLD = {"_idlc/a.py": "a = 1\n", "msg/__init__.py": "1\n", "msg/_a.py": "1\n", "srv/_s.py": "1\n"}
NEW = {"_idlc/a.py": "a = 2\n", "msg/__init__.py": "2\n", "msg/_b.py": "2\n", "action/_g.py": "2\n"}
NEWER = {"_idlc/a.py": "a = 3\n", "msg/__init__.py": "3\n", "msg/_b.py": "3\n", "x/_y.py": "3\n"}

#: What writes, moves or removes; a failure is injected into each call of each.
OPERATIONS = ("replace", "open", "write", "mkdir", "unlink")


def tree(folder: Path) -> dict[str, str]:
    return {
        path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8")
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def put(out: Path, files: dict[str, str], report: Report, *, force: bool = False) -> bool:
    known = load_lock(out, "out", report)
    content = {path: text.encode() for path, text in files.items()}
    owned = write.owned_files(known.outputs if known else {})
    planned = plan(out, "out", content, owned, report, record="idlc.lock", force=force)
    return planned is not None and write.apply(planned, "out", report, recorded)


def recorded(outputs: dict[str, str]) -> bytes:
    record = lock.Lock(
        format=lock.FORMAT,
        idlc="0",
        package="p",
        inputs={},
        dependencies={},
        types={},
        outputs=outputs,
    )
    return lock.encode(record)


def generated(out: Path) -> dict[str, str]:
    """Return the tree without idlc's own records, which must be the lock alone."""
    found = tree(out)
    del found["idlc.lock"]
    return found


def codes_of(report: Report) -> list[str]:
    return [found.code for found in report]


@pytest.fixture
def out(tmp_path) -> Path:
    assert put(tmp_path / "out", OLD, Report())
    return tmp_path / "out"


class Faulty:
    """Counts calls of an operating system's function and lets those in `failing` raise."""

    def __init__(self, monkeypatch, operation: str, failing, error: BaseException) -> None:
        self.count = 0
        real = getattr(os, operation)

        def replacement(path, *args, **kwargs):
            if operation == "open" and not args[0] & os.O_CREAT:
                return real(path, *args, **kwargs)
            self.count += 1
            if self.count in failing:
                raise error
            return real(path, *args, **kwargs)

        monkeypatch.setattr(os, operation, replacement)
        if sys.version_info < (3, 11) and operation in ("replace", "mkdir", "unlink"):
            # where Path has the system's functions from before
            monkeypatch.setattr(pathlib._NormalAccessor, operation, staticmethod(replacement))


def test_a_second_run_replaces_removes_and_leaves_nothing_behind(out):
    assert put(out, NEW, Report())
    assert generated(out) == NEW
    assert not (out / "srv").exists()


def test_an_unchanged_run_touches_no_file(out):
    before = {path: path.stat().st_ino for path in out.rglob("*") if path.is_file()}
    assert put(out, OLD, Report())
    assert {path: path.stat().st_ino for path in out.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize("force", [False, True])
@pytest.mark.parametrize("operation", OPERATIONS)
def test_a_failure_at_any_point_leaves_everything_as_it_was(operation, force, out, monkeypatch):
    if force:
        (out / "msg/__init__.py").write_text("mine\n", encoding="utf-8")
    before = tree(out)
    failed = 0
    for point in range(1, 100):
        with monkeypatch.context() as patch:
            fault = Faulty(patch, operation, {point}, OSError(errno.ENOSPC, "No space left"))
            report = Report()
            done = put(out, NEW, report, force=force)
        if fault.count < point:
            assert done
            break
        if done and operation == "unlink":  # tidying up afterwards may fail
            assert generated(out).items() >= NEW.items()
            break
        assert not done, f"{operation} number {point} failed unnoticed"
        assert tree(out) == before, f"{operation} number {point}"
        assert {"IDL612", "IDL614"}.intersection(codes_of(report))
        failed += 1
    assert failed


def test_a_failed_first_run_leaves_no_folder(tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        Faulty(patch, "replace", {3}, OSError(errno.EIO, "I/O error"))
        report = Report()
        assert not put(tmp_path / "a/b/out", NEW, report)
    assert codes_of(report) == ["IDL612"]
    assert list(tmp_path.iterdir()) == []


def test_when_undoing_fails_too_the_report_says_which_files_are_new(out, monkeypatch):
    with monkeypatch.context() as patch:
        Faulty(patch, "replace", set(range(4, 99)), OSError(errno.EIO, "I/O error"))
        report = Report()
        assert not put(out, NEW, report)
    (problem,) = report
    assert "_idlc/a.py" in problem.hint
    assert "msg/__init__.py" in problem.hint
    assert "_b.py" not in problem.hint
    assert put(out, NEWER, Report()), "the next run knows its own files all the same"
    assert generated(out) == NEWER


@pytest.mark.parametrize("operation", ["replace", "open", "write", "unlink"])
def test_killed_at_any_point_each_file_is_whole_and_the_next_run_recovers(
    operation, out, monkeypatch
):
    class Killed(BaseException):
        pass

    for point in range(1, 100):
        assert put(out, OLD, Report())
        with monkeypatch.context() as patch:
            patch.setattr("idlc.project.write._Transaction._undo", lambda _: [])
            fault = Faulty(patch, operation, {point}, Killed())
            with contextlib.suppress(Killed):
                put(out, NEW, Report())
        for path, text in tree(out).items():
            if not path.startswith(write.STAGE) and path != "idlc.lock":
                assert text in (OLD.get(path), NEW.get(path))
        lock.decode((out / "idlc.lock").read_bytes())
        report = Report()
        assert put(out, NEWER, report), codes_of(report)
        assert generated(out) == NEWER
        if fault.count < point:
            break


def test_an_interrupt_undoes_and_goes_on(out, monkeypatch):
    with monkeypatch.context() as patch:
        Faulty(patch, "replace", {3}, KeyboardInterrupt())
        with pytest.raises(KeyboardInterrupt):
            put(out, NEW, Report())
    assert generated(out) == OLD


def test_the_lock_comes_first_with_both_digests_and_last_with_the_new_ones(out, monkeypatch):
    moved = []
    real = os.replace

    def replace(path, target):
        moved.append((Path(target).name, Path(path).read_bytes()))
        return real(path, target)

    monkeypatch.setattr(os, "replace", replace)
    assert put(out, NEW, Report())
    assert [number for number, (name, _) in enumerate(moved) if name == "idlc.lock"] == [
        0,
        len(moved) - 1,
    ]
    first, last = (lock.decode(moved[number][1]).outputs for number in (0, -1))
    old, new = (
        {path: step.digest(text.encode()) for path, text in files.items()} for files in (OLD, NEW)
    )
    assert last == new
    assert first == {
        path: " ".join(filter(None, (new.get(path), old.get(path)))) for path in old | new
    }


def test_the_lock_is_on_the_disk_before_anything_moves(out, monkeypatch):
    calls = []
    for name in ("fsync", "replace"):
        real = getattr(os, name)

        def call(*words, name=name, real=real):
            calls.append((name, os.fstat(words[0]).st_ino if name == "fsync" else words[1]))
            return real(*words)

        monkeypatch.setattr(os, name, call)
    assert put(out, NEW, Report())
    kinds = [name for name, _ in calls]
    assert kinds[:2] == ["fsync", "fsync"]
    assert "fsync" not in kinds[2:]
    assert calls[-1] == ("replace", str(out / "idlc.lock"))
    assert calls[1][1] == (out / "idlc.lock").stat().st_ino


@pytest.mark.parametrize("left", ["", "\0\0\0\0"])
def test_a_file_that_lost_its_content_with_the_power_is_written_again(left, out):
    for path in NEW:
        if (out / path).is_file():
            (out / path).write_text(left, encoding="utf-8")
    assert put(out, NEW, Report())
    assert generated(out) == NEW


def test_an_edit_after_an_interrupted_run_is_refused(out, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr("idlc.project.write._Transaction._undo", lambda _: [])
        Faulty(patch, "replace", {3}, KeyboardInterrupt())
        with pytest.raises(KeyboardInterrupt):
            put(out, NEW, Report())
    (out / "msg/__init__.py").write_text("mine\n", encoding="utf-8")
    before, report = tree(out), Report()
    assert not put(out, NEWER, report)
    assert codes_of(report) == ["IDL613"]
    assert tree(out) == before


def test_an_edit_that_was_to_be_replaced_by_an_interrupted_run_stays_one(out, monkeypatch):
    (out / "msg/__init__.py").write_text("mine\n", encoding="utf-8")
    with monkeypatch.context() as patch:
        patch.setattr("idlc.project.write._Transaction._undo", lambda _: [])
        Faulty(patch, "replace", {2}, KeyboardInterrupt())
        with pytest.raises(KeyboardInterrupt):
            put(out, NEW, Report(), force=True)
    report = Report()
    assert not put(out, NEWER, report)
    assert codes_of(report) == ["IDL613"]


def test_an_undone_file_has_the_mode_that_it_had(out, monkeypatch):
    (out / "_idlc/a.py").chmod(0o755)
    with monkeypatch.context() as patch:
        Faulty(patch, "replace", {3}, OSError(errno.EIO, "I/O error"))
        assert not put(out, NEW, Report())
    assert (out / "_idlc/a.py").stat().st_mode & 0o777 == 0o755


def test_where_nothing_can_be_locked_a_run_goes_on_alone(out, monkeypatch):
    import fcntl

    def refuse(*_):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", refuse)
    assert put(out, NEW, Report())
    assert generated(out) == NEW
    (out / write.STAGE).mkdir()
    before, report = tree(out), Report()
    assert not put(out, OLD, report)
    (problem,) = report
    assert problem.code == "IDL612"
    assert "another run" in problem.message
    assert (tree(out), (out / write.STAGE).is_dir()) == (before, True)


def test_edited_files_are_refused_with_a_difference_and_nothing_is_written(out):
    (out / "msg/_a.py").write_text("mine\n", encoding="utf-8")
    (out / "msg/__init__.py").write_text("mine\n", encoding="utf-8")
    before = tree(out)
    report = Report()
    assert not put(out, NEW, report)
    assert tree(out) == before
    replaced, removed = report
    assert (replaced.code, removed.code) == ("IDL613", "IDL613")
    assert "-mine" in replaced.detail
    assert "+2" in replaced.detail
    assert "would remove it" in removed.message


def test_force_keeps_copies_and_never_overwrites_one(out):
    for text in ("mine\n", "mine again\n"):
        (out / "msg/__init__.py").write_text(text, encoding="utf-8")
        assert put(out, NEW, Report(), force=True)
    assert (out / "msg/__init__.py.bak").read_text(encoding="utf-8") == "mine\n"
    assert (out / "msg/__init__.py.bak1").read_text(encoding="utf-8") == "mine again\n"
    assert (out / "msg/__init__.py").read_text(encoding="utf-8") == "2\n"


def test_a_file_that_is_as_it_would_be_written_is_adopted(out):
    (out / "idlc.lock").unlink()
    assert put(out, OLD, Report())
    assert lock.decode((out / "idlc.lock").read_bytes()).outputs.keys() == OLD.keys()


def test_without_a_lock_nothing_is_replaced_or_removed(out):
    (out / "idlc.lock").unlink()
    before = tree(out)
    report = Report()
    assert not put(out, NEW, report)
    assert set(codes_of(report)) == {"IDL614"}
    assert tree(out) == before


def test_the_users_own_init_stays_and_is_not_claimed(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "__init__.py").write_text("mine = 1\n", encoding="utf-8")
    for _ in range(2):
        assert put(out, {"__init__.py": "", "py.typed": "", **OLD}, Report())
    assert (out / "__init__.py").read_text(encoding="utf-8") == "mine = 1\n"
    assert "__init__.py" not in lock.decode((out / "idlc.lock").read_bytes()).outputs


def test_links_below_the_package_are_not_followed(out, tmp_path):
    elsewhere = tmp_path / "elsewhere"
    (out / "srv").rename(elsewhere)
    (out / "srv").symlink_to(elsewhere)
    assert put(out, NEW, Report()), "a stale file beyond a link is left alone"
    assert tree(elsewhere) == {"_s.py": "1\n"}
    report = Report()
    assert not put(out, {"srv/_t.py": "2\n"}, report, force=True)
    assert codes_of(report) == ["IDL614"]
    assert tree(elsewhere) == {"_s.py": "1\n"}


def test_a_package_folder_that_is_a_link_is_fine(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "out").symlink_to(tmp_path / "real")
    assert put(tmp_path / "out", OLD, Report())
    assert generated(tmp_path / "real") == OLD


@pytest.mark.parametrize("where", ["folder", "file"])
def test_what_is_not_a_file_is_refused(where, tmp_path):
    out = tmp_path / "out"
    if where == "folder":
        (out / "msg/_a.py").mkdir(parents=True)
    else:
        out.mkdir()
        (out / "msg").write_text("", encoding="utf-8")
    report = Report()
    assert not put(out, OLD, report, force=True)
    assert set(codes_of(report)) == {"IDL614"}


def test_interface_files_beside_generated_ones_are_safe(out):
    (out / "srv/S.srv").write_text("---\n", encoding="utf-8")
    (out / "srv/__pycache__").mkdir()
    (out / "srv/__pycache__/_s.cpython-311.pyc").write_bytes(b"")
    assert put(out, NEW, Report())
    assert tree(out / "srv") == {"S.srv": "---\n"}


def test_a_removed_module_takes_its_bytecode_and_its_folder_with_it(out):
    (out / "srv/__pycache__").mkdir()
    (out / "srv/__pycache__/_s.cpython-311.pyc").write_bytes(b"")
    assert put(out, NEW, Report())
    assert not (out / "srv").exists()


def test_a_lock_that_points_outside_is_refused(out, tmp_path):
    target = tmp_path / "precious"
    target.write_text("1\n", encoding="utf-8")
    text = (out / "idlc.lock").read_text(encoding="utf-8")
    (out / "idlc.lock").write_text(text.replace("srv/_s.py", "../precious"), encoding="utf-8")
    report = Report()
    put(out, NEW, report)
    assert "IDL615" in codes_of(report)
    assert target.exists()
