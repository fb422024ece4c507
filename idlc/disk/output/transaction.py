"""Carrying a plan out: all or nothing, each file whole at any moment, the lock last.

Everything is first written into a staging folder, then moved into place file by file. When a
move fails the earlier ones are undone. When the process is killed the staging folder stays; the
next run reads from it which files are idlc's own.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report
from idlc.disk.output import lock_file
from idlc.disk.output.folder_lock import alone, uninterrupted
from idlc.disk.output.tree import Tree
from idlc.disk.output.whole_files import create, replace
from idlc.disk.output.write_plan import Change, Plan, emptied
from idlc.disk.read import is_folder, reason

STAGE = ".idlc-stage-"


def owned(out: Path, known: lock_file.Lock | None) -> dict[str, frozenset[str]]:
    """Return the files that idlc wrote below `out`, each with the digests that it may have."""
    found = {path: frozenset((one,)) for path, one in (known.outputs if known else {}).items()}
    for journal in journals(out):
        with contextlib.suppress(ValueError):
            for path, one in lock_file.decode(journal).outputs.items():
                found[path] = found.get(path, frozenset()) | {one}
    return found


def journals(out: Path) -> Iterator[bytes]:
    """Yield what killed runs wrote down about the files that they were moving into place."""
    for stage in _abandoned(out):
        with contextlib.suppress(OSError):
            yield (stage / lock_file.FILE).read_bytes()


def _abandoned(out: Path) -> list[Path]:
    try:
        names = sorted(name for name in os.listdir(out) if name.startswith(STAGE))  # noqa: PTH208
        return [out / name for name in names if not _in_use(out / name)]
    except OSError:
        return []


def _in_use(stage: Path) -> bool:
    """Return whether the process that made a staging folder may still be running."""
    number = stage.name.removeprefix(STAGE)
    if not number.isdigit() or int(number) == os.getpid():
        return False
    if sys.platform == "win32":
        from idlc.disk.output import windows

        return windows.is_running(int(number))
    try:
        os.kill(int(number), 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def apply(plan: Plan, new_lock: bytes, name: str, report: Report) -> bool:
    """Make the changes and write the lock; report IDL612 and return `False` on a failure.

    After a failure every file is as it was, or the report says which are not.
    """
    if not plan.changes and plan.record == new_lock:
        with contextlib.suppress(OSError):  # a package that cannot be written may be right
            os.utime(plan.out / plan.home / lock_file.FILE)
        sweep(plan.out / plan.home)
        return True
    change = Change(plan.home + lock_file.FILE, plan.record, new_lock)
    whole = plan._replace(changes=(*plan.changes, change))
    return _carry_out(whole, new_lock, name, report)


def _carry_out(plan: Plan, journal: bytes, name: str, report: Report) -> bool:
    """Make all changes or none; report IDL612 and return `False` on a failure."""
    out = plan.out
    with alone(out):
        try:
            transaction = _Transaction(out, plan.home)
        except OSError as error:
            report.add(_failure(name, error))
            return False
        left, changed = _left(out, plan.changes)
        if changed is not None:
            transaction.undo()
            report.add(_meanwhile(name, changed))
            return False
        try:
            transaction.run(left, journal)
        except BaseException as error:
            with uninterrupted():
                torn = transaction.undo()
            if not isinstance(error, OSError):
                raise
            where = f"{name}/{transaction.current}" if transaction.current else name
            message = f"cannot write `{where}`: {reason(error)}"
            report.add(codes.CANNOT_WRITE.of(where, message, hint=_outcome(torn, name)))
            return False
        sweep(out / plan.home)
    return True


def _left(out: Path, changes: tuple[Change, ...]) -> tuple[tuple[Change, ...], str | None]:
    """Return the changes that nobody else has made meanwhile, and the first that cannot be made."""
    tree = Tree(out)
    left = []
    for change in changes:
        now = tree.read(change.path)
        if now == change.new:
            continue
        if now != change.old:
            return (), change.path
        left.append(change)
    return tuple(left), None


def _meanwhile(name: str, path: str) -> Diagnostic:
    return codes.CANNOT_WRITE.of(
        f"{name}/{path}",
        f"`{name}/{path}` was changed while idlc was running",
        hint=f"nothing in `{name}` was changed by this run; run it again",
    )


def _failure(name: str, error: OSError) -> Diagnostic:
    return codes.CANNOT_WRITE.of(name, f"cannot write to `{name}`: {reason(error)}")


def apply_changes(plan: Plan, name: str, report: Report, journal: bytes = b"") -> bool:
    """Make changes in a folder that has no lock; report IDL612 and return `False` on a failure."""
    if not plan.changes:
        return True
    return _carry_out(plan, journal, name, report)


def _outcome(torn: list[str], name: str) -> str:
    if not torn:
        return f"nothing in `{name}` was changed"
    return "undoing failed as well; these files are new, the others as before: " + ", ".join(torn)


def sweep(out: Path) -> None:
    """Remove what killed runs left."""
    for stage in _abandoned(out):
        _remove(stage)


def _remove(stage: Path) -> None:
    """Remove a staging folder, which holds no folders."""
    with contextlib.suppress(OSError):
        for path in stage.iterdir():
            path.chmod(0o600)  # Windows removes no file that is not for writing
            path.unlink()
        stage.rmdir()


class _Transaction:
    """Moves staged files into place and remembers how to go back."""

    def __init__(self, out: Path, home: str) -> None:
        self._out = out
        self._stage = out / home / f"{STAGE}{os.getpid()}"
        self._made: list[Path] = []
        self._done: list[tuple[str, bytes | None]] = []
        self._there: set[str] = set()
        self.current = ""
        self._make_folder(out)

    def _make_folder(self, folder: Path) -> None:
        missing = []
        while not is_folder(folder):
            missing.append(folder)
            folder = folder.parent
        for path in reversed(missing):
            path.mkdir()
            self._made.append(path)

    def run(self, changes: tuple[Change, ...], journal: bytes) -> None:
        """Make all changes, in order; raises what stopped it."""
        self._make_folder(self._stage)
        create(f"{self._stage}/{lock_file.FILE}", journal)
        for number, change in enumerate(changes):
            if change.new is not None:
                self.current = change.path
                create(f"{self._stage}/{number}", change.new)
        with uninterrupted():
            self._move(changes)
        self.current = ""
        self._remove_empty(changes)
        _remove(self._stage)

    def _move(self, changes: tuple[Change, ...]) -> None:
        for number, change in enumerate(changes):
            self.current = change.path
            target = f"{self._out}/{change.path}"
            if change.backup and change.old is not None:
                self._keep(change.path, change.old)
            if change.new is None:
                Path(target).unlink()
            else:
                staged = f"{self._stage}/{number}"
                if change.old is not None:
                    Path(staged).chmod(Path(target).stat().st_mode & 0o7777)
                self._make_parent(change.path)
                replace(staged, target)
            self._done.append((change.path, change.old))

    def _make_parent(self, path: str) -> None:
        folder = path.rpartition("/")[0]
        if folder not in self._there:
            self._make_folder(self._out / folder)
            self._there.add(folder)

    def _keep(self, path: str, content: bytes) -> None:
        """Write a copy of a file beside it, under a name that is free."""
        for suffix in _suffixes():
            with contextlib.suppress(FileExistsError):
                create(f"{self._out}/{path}{suffix}", content, os.O_EXCL)
                self._done.append((path + suffix, None))
                return

    def _remove_empty(self, changes: tuple[Change, ...]) -> None:
        for change in changes:
            if change.new is None:
                target = self._out / change.path
                for cached in (target.parent / "__pycache__").glob(f"{target.stem}.*.pyc"):
                    with contextlib.suppress(OSError):
                        cached.unlink()
        for folder in emptied(changes):
            for path in (self._out / folder / "__pycache__", self._out / folder):
                with contextlib.suppress(OSError):
                    path.rmdir()

    def undo(self) -> list[str]:
        """Go back to the state before; return the files for which that failed."""
        torn = []
        for path, old in reversed(self._done):
            target = self._out / path
            try:
                if old is None:
                    target.unlink(missing_ok=True)
                else:
                    spare = self._stage / "old"
                    create(str(spare), old)
                    target.parent.mkdir(parents=True, exist_ok=True)
                    replace(str(spare), str(target))
            except OSError:
                torn.append(path)
        if not torn:
            _remove(self._stage)
        for folder in reversed(self._made):
            with contextlib.suppress(OSError):
                folder.rmdir()
        return torn


def _suffixes() -> Iterator[str]:
    yield ".bak"
    number = 1
    while True:
        yield f".bak{number}"
        number += 1
