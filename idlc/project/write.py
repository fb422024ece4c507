"""The writer: every file that idlc writes for users goes through `apply`.

A package's record (`idlc.lock`) is written first, with the old and the new digest of each file,
and last with the new ones alone. So whatever ends a run, the next one knows idlc's own files.
"""

from __future__ import annotations

import contextlib
import enum
import itertools
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import NamedTuple, TypeAlias

from idlc.diagnostics import codes
from idlc.diagnostics import report as diagnostics
from idlc.diagnostics.report import Diagnostic, Edit, Report
from idlc.project.atomic import create, exclusive, make_folder, move_over, uninterrupted
from idlc.project.files import entries, reason
from idlc.project.lock import Obstacle, Tree, is_same, may_be_own
from idlc.project.step import digest

#: Files of a package that are the user's where they exist already.
YIELDING = frozenset({"__init__.py", "py.typed"})
DIFF_LINES = 40
#: Refused files that are shown with a diff; the others are only named.
DIFFS = 10
#: The folder of drafts, beside the record; where the system has no locks, it is one.
STAGE = ".idlc-stage-new"

#: Paths below a folder, each with the digests of a file that idlc wrote there.
Owned: TypeAlias = Mapping[str, frozenset[str]]
#: Turns the digests of files into the content of their record.
Render: TypeAlias = Callable[[dict[str, str]], bytes]


class Ownership(enum.Enum):
    """The ownership of a file that is to be written, replaced or removed."""

    OWN = "nothing, or what idlc wrote"
    EDITED = "what idlc wrote, edited since"
    FOREIGN = "a file that idlc did not write"
    USERS = "a file that idlc did not write, and that stays"


class FileChange(NamedTuple):
    """One file to create, replace or remove; `path` is relative to the folder of its plan.

    `old` and `new` are its content before and after, `None` where there is no file. A copy is
    kept of a file that is not idlc's own.
    """

    path: str
    old: bytes | None
    new: bytes | None
    ownership: Ownership = Ownership.OWN


class WritePlan(NamedTuple):
    """Changes in the order in which to make them, and the digests of all files afterwards.

    `record` is the path of the record, if there is one, and `recorded` its content before.
    """

    out: Path
    changes: tuple[FileChange, ...]
    outputs: dict[str, str]
    record: str = ""
    recorded: bytes | None = None


def compare(
    out: Path, name: str, files: Mapping[str, bytes], owned: Owned, report: Report
) -> list[FileChange]:
    """Return the changes after which `out` holds `files`, and no other files of `owned`.

    `name` is the name of `out` in messages. Reports IDL614 for what is in the way.
    """
    tree = Tree(out)
    stale = owned.keys() - files.keys()
    renamed = tree.renamed(stale, files)
    owned = {**owned, **{new: owned[old] | owned.get(new, set()) for old, new in renamed.items()}}
    changes = []
    for path in (*files, *sorted(stale - renamed.keys())):
        old, new = tree.read(path), files.get(path)
        if isinstance(old, Obstacle):
            if new is not None:
                report.add(_in_the_way(shown(name, path), old))
        elif not is_same(old, new):
            changes.append(FileChange(path, old, new, _ownership(path, old, owned)))
    return changes


def _ownership(path: str, old: bytes | None, owned: Owned) -> Ownership:
    if old is None or digest(old) in owned.get(path, ()):
        return Ownership.OWN
    if path in owned:
        # a loss of power leaves files without their content
        return Ownership.EDITED if old.strip(b"\0") else Ownership.OWN
    return Ownership.USERS if path in YIELDING else Ownership.FOREIGN


def shown(name: str, path: str) -> str:
    """Return the name in messages of a file in the folder `name`."""
    return path if name in ("", ".") else f"{name}/{path}"


def plan(
    out: Path,
    name: str,
    files: Mapping[str, bytes],
    owned: Owned,
    report: Report,
    *,
    record: str,
    force: bool = False,
    again: str = "",
) -> WritePlan | None:
    """Return the changes after which `out` holds `files`; `None` after a report if it must not.

    A file that is not owned, or was edited since, is only replaced with `force`, which is what
    `again` runs, if there is such a command. Reports IDL613 and IDL614.
    """
    problems = diagnostics.Report()
    changes = compare(out, name, files, {p: d for p, d in owned.items() if p != record}, problems)
    recorded = Tree(out).read(record)
    if isinstance(recorded, Obstacle):
        problems.add(_in_the_way(shown(name, record), recorded))
    left_alone = {each.path for each in changes if each.ownership is Ownership.USERS}
    changes = [each for each in changes if each.path not in left_alone]
    if not force:
        refused = [each for each in changes if each.ownership is not Ownership.OWN]
        problems.extend(
            _refusal(shown(name, change.path), change, again, in_full=number < DIFFS)
            for number, change in enumerate(refused)
        )
    report.extend(problems)
    if problems.had_errors or isinstance(recorded, Obstacle):
        return None
    outputs = {path: digest(data) for path, data in files.items() if path not in left_alone}
    return WritePlan(out, tuple(changes), outputs, record, recorded)


def _in_the_way(shown_path: str, obstacle: Obstacle) -> Diagnostic:
    message = f"cannot write `{shown_path}`: {obstacle.what}"
    hint = "move it away, or write to another folder"
    return codes.FOREIGN_FILE.of(shown_path, message, hint=hint)


def _refusal(path: str, change: FileChange, again: str, *, in_full: bool) -> Diagnostic:
    diff = ""
    if in_full and change.new is not None:
        diff = "\n".join(difference(change.old or b"", change.new))
    if change.ownership is Ownership.FOREIGN:
        code, message = codes.FOREIGN_FILE, "already exists, and idlc did not write it"
        ways = ["move it away", "choose another folder"]
    else:
        code, message = codes.EDITED_FILE, "was edited after idlc wrote it"
        message += ", and idlc would remove it" if change.new is None else ""
        ways = ["move the edit out of the generated code"]
    if again:
        ways.append(f"run `{again}`, which keeps a copy of the file")
    hint = ", or ".join(filter(None, (", ".join(ways[:-1]), ways[-1])))
    return code.of(path, f"`{path}` {message}", hint=hint, detail=diff)


def difference(old: bytes, new: bytes) -> Iterator[str]:
    """Yield a unified diff from the file on disk to idlc's, cut when long."""
    import difflib

    before, after = (data.decode("utf-8", errors="replace").splitlines() for data in (old, new))
    lines = [*difflib.unified_diff(before, after, "on disk", "from idlc", lineterm="", n=1)]
    yield from lines[:DIFF_LINES]
    if len(lines) > DIFF_LINES:
        yield f"… and {len(lines) - DIFF_LINES} more lines"


def owned_files(outputs: Mapping[str, str]) -> dict[str, frozenset[str]]:
    """Return the files that a record lists, each with the digests that it may have.

    The record of an interrupted run has two for a file.
    """
    return {
        path: frozenset(digests.split())
        for path, digests in outputs.items()
        if may_be_own(path) and isinstance(digests, str)
    }


def apply(plan: WritePlan, name: str, report: Report, render: Render | None = None) -> bool:
    """Make changes, all or none; report IDL612 and return `False` on a failure.

    After a failure every file is as it was, or the report names the others. `render` makes the
    content of the record, for a plan that has one.
    """
    with exclusive(plan.out) as is_locked:
        tree, changes = Tree(plan.out), []
        record = [FileChange(plan.record, plan.recorded, plan.recorded)] if render else []
        for change in (*plan.changes, *record):
            now = tree.read(change.path)
            if now not in (change.old, change.new):
                path = shown(name, change.path)
                message = f"`{path}` was changed while idlc was running"
                report.add(codes.CANNOT_WRITE.of(path, message, hint="run it again"))
                return False
            changes += [change] if now != change.new else []
        home = (plan.out / plan.record).parent if plan.record else plan.out
        if render:
            changes = _recorded(changes, plan, render)
            if not changes:
                with contextlib.suppress(OSError):  # a package that cannot be written may be right
                    os.utime(plan.out / plan.record)
        sweep(home)
        if not is_locked and os.path.lexists(home / STAGE):
            path = shown(name, (home / STAGE).relative_to(plan.out).as_posix())
            message = f"`{path}` belongs to another run, and this file system cannot lock folders"
            hint = "wait for that run, or remove the folder if none is running"
            report.add(codes.CANNOT_WRITE.of(path, message, hint=hint))
            return False
        return not changes or _Transaction(plan, home / STAGE).run(changes, name, report)


def _recorded(changes: list[FileChange], plan: WritePlan, render: Render) -> list[FileChange]:
    """Return changes with those of the record: both digests before the others, one after them."""
    final = render(plan.outputs)
    first = final
    if changes:
        digests = dict(plan.outputs)
        for path, old, _, ownership in changes:
            if old is not None and ownership is Ownership.OWN:
                digests[path] = f"{digests.get(path, '')} {digest(old)}".lstrip()
        first = render(digests)
    before, after = (
        FileChange(plan.record, plan.recorded, first),
        FileChange(plan.record, first, final),
    )
    return [each for each in (before, *changes, after) if each.old != each.new]


def sweep(folder: Path) -> None:
    """Remove the drafts that killed runs left in a folder, if no other run can be at work."""
    with exclusive(folder) as is_locked:
        for path in entries(folder) if is_locked else ():
            if path.name.startswith(STAGE.removesuffix("new")):
                _remove(path)


def _remove(stage: Path) -> None:
    """Remove a folder of drafts, which holds no folders."""
    with contextlib.suppress(OSError):
        for path in stage.iterdir():
            path.chmod(0o600)  # Windows removes no file that is not for writing
            path.unlink()
        stage.rmdir()


class _Transaction:
    """Moves drafts into place, and can undo that."""

    def __init__(self, plan: WritePlan, stage: Path) -> None:
        self._out = plan.out
        self._record = plan.record
        self._stage = stage
        self._created: list[Path] = []
        self._done: list[tuple[str, bytes | None, int]] = []
        self._current = ""

    def run(self, changes: list[FileChange], name: str, report: Report) -> bool:
        """Make all changes, in order, or none; report IDL612."""
        try:
            make_folder(self._stage.parent, self._created)
            self._stage.mkdir()
            self._created.append(self._stage)
            for number, change in enumerate(changes):
                if change.new is not None:
                    self._current = change.path
                    # only the record must be on the disk when the others move
                    is_record = change.path == self._record
                    create(f"{self._stage}/{number}", change.new, sync=is_record)
            with uninterrupted():
                for number, change in enumerate(changes):
                    self._current = change.path
                    self._make(change, f"{self._stage}/{number}")
        except BaseException as error:
            with uninterrupted():
                torn = self._undo()
            if not isinstance(error, OSError):
                raise
            where = shown(name, self._current) if self._current else name
            hint = f"no file in `{name}` was changed"
            if torn:
                hint = "restoring the old files failed, too; these files are new: "
                hint += ", ".join(torn)
            message = f"cannot write `{where}`: {reason(error)}"
            report.add(codes.CANNOT_WRITE.of(where, message, hint=hint))
            return False
        self._tidy(changes)
        return True

    def _make(self, change: FileChange, draft: str) -> None:
        path, old, new, ownership = change
        target, mode = self._out / path, 0
        if ownership is not Ownership.OWN and old is not None:
            self._keep(path, old)
        if old is not None:
            mode = target.stat().st_mode & 0o7777
        if new is None:
            target.unlink()
        else:
            if mode:
                Path(draft).chmod(mode)
            make_folder(target.parent, self._created)
            move_over(draft, str(target))
        self._done.append((path, old, mode))

    def _keep(self, path: str, content: bytes) -> None:
        """Write a copy of a file beside it, under a name that is free."""
        for number in itertools.count():
            kept = f"{path}.bak{number or ''}"
            with contextlib.suppress(FileExistsError):
                create(f"{self._out}/{kept}", content, os.O_EXCL)
                self._done.append((kept, None, 0))
                return

    def _undo(self) -> list[str]:
        """Restore all files; return those for which that failed."""
        torn: list[str] = []
        for path, old, mode in reversed(self._done):
            if torn and path == self._record:
                break  # it goes on to list old files and new ones
            target, draft = self._out / path, self._stage / "old"
            try:
                if old is None:
                    target.unlink(missing_ok=True)
                    continue
                make_folder(self._stage, self._created)
                make_folder(target.parent, self._created)
                create(str(draft), old)
                draft.chmod(mode)
                move_over(str(draft), str(target))
            except OSError:
                torn.append(path)
        _remove(self._stage)
        for folder in reversed(self._created):
            with contextlib.suppress(OSError):
                folder.rmdir()
        return torn

    def _tidy(self, changes: list[FileChange]) -> None:
        """Remove drafts, byte code of removed modules, and folders that are empty now."""
        folders: set[Path] = set()
        for change in changes:
            if change.new is None:
                target = self._out / change.path
                folders.update(self._out / above for above in PurePosixPath(change.path).parents)
                for cached in (target.parent / "__pycache__").glob(f"{target.stem}.*.pyc"):
                    with contextlib.suppress(OSError):
                        cached.unlink()
        for folder in sorted(folders - {self._out}, key=lambda each: -len(each.parts)):
            for path in (folder / "__pycache__", folder):
                with contextlib.suppress(OSError):
                    path.rmdir()
        _remove(self._stage)


def rewrite(path: Path, name: str, old: str, new: str, report: Report) -> bool:
    """Give a file new content; report IDL612 and return `False` if that fails.

    A link stays one, and the file that it leads to is replaced.
    """
    target = path.resolve()
    change = FileChange(target.name, old.encode("utf-8"), new.encode("utf-8"))
    folder = PurePosixPath(name).parent.as_posix()
    return apply(WritePlan(target.parent, (change,), {}), folder, report)


class EditedFile(NamedTuple):
    """The name of a file, its text before and after edits, and the number of applied edits."""

    name: str
    old: str
    new: str
    edits: int


def edited(
    edits: Iterable[Edit], keep_layout: Callable[[str, str, str], str]
) -> Iterator[EditedFile]:
    """Apply edits to the texts of their files; this writes nothing.

    `keep_layout` takes a file's name, its old text and its edited text, and returns the new text.
    """
    by_path: dict[str, list[Edit]] = {}
    for edit in edits:
        by_path.setdefault(edit.span.source.path, []).append(edit)
    for name, own in by_path.items():
        old = own[0].span.source.text
        text, number = diagnostics.apply(old, own)
        yield EditedFile(name, old, keep_layout(name, old, text), number)
