"""Plans for writing files: all or nothing, each file whole at any moment, the lock last.

All files are first written into a staging folder, then moved into place one by one. When a move
fails the earlier ones are undone. When the process is killed the staging folder stays; the next
run reads from it which files are idlc's own.
"""

from __future__ import annotations

import contextlib
import enum
import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report
from idlc.project import lock
from idlc.project.atomic import create, exclusive, move_over, uninterrupted
from idlc.project.files import is_folder, reason
from idlc.project.lock import FILE, Obstacle, Tree, digest, is_same

#: Files of a package that are the user's where they exist already.
YIELDING = frozenset({"__init__.py", "py.typed"})
DIFF_LINES = 40
#: Refused files that are shown with a diff; the others are only named.
DIFFS = 10


class Change(NamedTuple):
    """One file to create, replace or remove; `path` is relative to the package folder.

    `old` and `new` are its content before and after, `None` where there is no file. A change
    with `backup` is to a file that is not idlc's own.
    """

    path: str
    old: bytes | None
    new: bytes | None
    backup: bool = False


class Plan(NamedTuple):
    """Changes in the order in which to make them, and the digests of all files afterwards.

    `record` is the lock's content when the changes were planned, if there was a lock. The lock is
    in `home`, which is empty or ends with a slash.
    """

    out: Path
    changes: tuple[Change, ...]
    outputs: dict[str, str]
    record: bytes | None = None
    home: str = ""


def plan(
    out: Path,
    name: str,
    files: Mapping[str, bytes],
    owned: Mapping[str, frozenset[str]],
    report: Report,
    *,
    force: bool = False,
    home: str = "",
) -> Plan | None:
    """Return the changes after which `out` holds `files`; `None` after a report if it must not.

    `owned` are the files that idlc wrote and the digests that they had. A file that is not owned,
    or was edited since, is only replaced with `force`. `name` is the name of `out` in messages.
    Reports IDL613 and IDL614.
    """
    tree = Tree(out)
    record = tree.read(home + FILE)
    changes: list[Change] = []
    refused: list[Diagnostic] = []
    outputs: dict[str, str] = {}
    stale = {path for path in owned if path not in files and path != home + FILE}
    renamed = tree.renamed(stale, files)
    owned = {**owned, **{new: owned[old] | owned.get(new, set()) for old, new in renamed.items()}}
    for path in (*files, *sorted(stale - renamed.keys())):
        old, new = tree.read(path), files.get(path)
        if isinstance(old, Obstacle):
            refused += [_in_the_way(name, path, old)] if new is not None else []
            continue
        ground = _ownership(path, old, owned)
        if ground is Ownership.USERS:
            continue
        if new is not None:
            outputs[path] = digest(new)
        if not is_same(old, new):
            if ground is not Ownership.OWN and not force:
                diff = _diff(old, new) if len(refused) < DIFFS else ""
                refused.append(_refusal(f"{name}/{path}", ground, diff, removed=new is None))
            changes.append(Change(path, old, new, backup=ground is not Ownership.OWN))
    if isinstance(record, Obstacle):
        refused.append(_in_the_way(name, home + FILE, record))
    report.extend(refused)
    if refused or isinstance(record, Obstacle):
        return None
    return Plan(out, tuple(changes), outputs, record, home)


class Ownership(enum.Enum):
    """The ownership of a file that is to be written, replaced or removed."""

    OWN = "nothing, or what idlc wrote"
    EDITED = "what idlc wrote, edited since"
    FOREIGN = "a file that idlc did not write"
    USERS = "a file that idlc did not write, and that stays"


def _ownership(path: str, old: bytes | None, owned: Mapping[str, frozenset[str]]) -> Ownership:
    if old is None or digest(old) in owned.get(path, ()):
        return Ownership.OWN
    if path in owned:
        return Ownership.EDITED
    return Ownership.USERS if path in YIELDING else Ownership.FOREIGN


def _in_the_way(name: str, path: str, obstacle: Obstacle) -> Diagnostic:
    return codes.FOREIGN_FILE.of(
        f"{name}/{path}",
        f"cannot write `{name}/{path}`: {obstacle.what}",
        hint="move it away, or choose another folder with -o",
    )


def _refusal(shown: str, ground: Ownership, diff: str, *, removed: bool) -> Diagnostic:
    if ground is Ownership.FOREIGN:
        return codes.FOREIGN_FILE.of(
            shown,
            f"`{shown}` is in the way and was not written by idlc",
            hint="move it away, choose another folder with -o, or run again with --force, "
            "which keeps a copy",
            detail=diff,
        )
    message = "was edited since idlc wrote it" + (", and is to be removed" if removed else "")
    return codes.EDITED_FILE.of(
        shown,
        f"`{shown}` {message}",
        hint="move the edit out of generated code, or run again with --force, which keeps a copy",
        detail=diff,
    )


def _diff(old: bytes | None, new: bytes | None) -> str:
    return "\n".join(difference(old or b"", new)) if new is not None else ""


def difference(old: bytes, new: bytes) -> Iterator[str]:
    """Yield a unified diff from the file on disk to idlc's, cut when long."""
    import difflib

    lines = list(
        difflib.unified_diff(_lines(old), _lines(new), "on disk", "from idlc", lineterm="", n=1)
    )
    yield from lines[:DIFF_LINES]
    if len(lines) > DIFF_LINES:
        yield f"… and {len(lines) - DIFF_LINES} more lines"


def _lines(data: bytes) -> list[str]:
    return data.decode("utf-8", errors="replace").splitlines()


def emptied_folders(changes: Iterable[Change]) -> list[str]:
    """Return the folders of removed files, the deepest first."""
    folders = {
        str(folder)
        for change in changes
        if change.new is None
        for folder in PurePosixPath(change.path).parents
        if folder.parts
    }
    return sorted(folders, key=lambda folder: (-folder.count("/"), folder))


STAGE = ".idlc-stage-"


def owned_files(out: Path, existing: lock.Lock | None) -> dict[str, frozenset[str]]:
    """Return the files that idlc wrote below `out`, each with the digests that it may have."""
    digests = {
        path: frozenset((value,)) for path, value in (existing.outputs if existing else {}).items()
    }
    for journal in journals(out):
        with contextlib.suppress(ValueError):
            for path, value in lock.decode(journal).outputs.items():
                digests[path] = digests.get(path, frozenset()) | {value}
    return digests


def journals(out: Path) -> Iterator[bytes]:
    """Yield the journals of killed runs, which list the files that they were moving into place."""
    for stage in _abandoned(out):
        with contextlib.suppress(OSError):
            yield (stage / lock.FILE).read_bytes()


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
        from idlc.project import atomic

        return atomic.is_running_on_windows(int(number))
    try:
        os.kill(int(number), 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def apply(plan: Plan, new_lock: bytes, name: str, report: Report) -> bool:
    """Make the changes and write the lock; report IDL612 and return `False` on a failure.

    After a failure every file is as it was, or the report names the others.
    """
    if not plan.changes and plan.record == new_lock:
        with contextlib.suppress(OSError):  # a package that cannot be written may be right
            os.utime(plan.out / plan.home / lock.FILE)
        sweep(plan.out / plan.home)
        return True
    change = Change(plan.home + lock.FILE, plan.record, new_lock)
    whole = plan._replace(changes=(*plan.changes, change))
    return _carry_out(whole, new_lock, name, report)


def _carry_out(plan: Plan, journal: bytes, name: str, report: Report) -> bool:
    """Make all changes or none; report IDL612 and return `False` on a failure."""
    out = plan.out
    with exclusive(out):
        try:
            transaction = _Transaction(out, plan.home)
        except OSError as error:
            report.add(_failure(name, error))
            return False
        left, changed = _pending(out, plan.changes)
        if changed is not None:
            transaction.undo()
            report.add(_changed_meanwhile(name, changed))
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


def _pending(out: Path, changes: tuple[Change, ...]) -> tuple[tuple[Change, ...], str | None]:
    """Return the changes that no other process has made meanwhile, and the first conflict."""
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


def _changed_meanwhile(name: str, path: str) -> Diagnostic:
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
    """Remove the staging folders of killed runs."""
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
    """Moves staged files into place, and can undo that."""

    def __init__(self, out: Path, home: str) -> None:
        self._out = out
        self._stage = out / home / f"{STAGE}{os.getpid()}"
        self._created: list[Path] = []
        self._done: list[tuple[str, bytes | None]] = []
        self._folders: set[str] = set()
        self.current = ""
        self._make_folder(out)

    def _make_folder(self, folder: Path) -> None:
        missing = []
        while not is_folder(folder):
            missing.append(folder)
            folder = folder.parent
        for path in reversed(missing):
            path.mkdir()
            self._created.append(path)

    def run(self, changes: tuple[Change, ...], journal: bytes) -> None:
        """Make all changes, in order; raises the first failure."""
        self._make_folder(self._stage)
        create(f"{self._stage}/{lock.FILE}", journal)
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
                move_over(staged, target)
            self._done.append((change.path, change.old))

    def _make_parent(self, path: str) -> None:
        folder = path.rpartition("/")[0]
        if folder not in self._folders:
            self._make_folder(self._out / folder)
            self._folders.add(folder)

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
        for folder in emptied_folders(changes):
            for path in (self._out / folder / "__pycache__", self._out / folder):
                with contextlib.suppress(OSError):
                    path.rmdir()

    def undo(self) -> list[str]:
        """Restore all files; return those for which that failed."""
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
                    move_over(str(spare), str(target))
            except OSError:
                torn.append(path)
        if not torn:
            _remove(self._stage)
        for folder in reversed(self._created):
            with contextlib.suppress(OSError):
                folder.rmdir()
        return torn


def _suffixes() -> Iterator[str]:
    yield ".bak"
    number = 1
    while True:
        yield f".bak{number}"
        number += 1
