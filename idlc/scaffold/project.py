"""A folder of the user: files that are added to it, files in it that are edited.

Unlike a generated package it has no lock: a file that exists and differs from the one to be
added is the user's. All changes are made in one go, or none.
"""

from __future__ import annotations

import difflib
from codecs import BOM_UTF8
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.project import write
from idlc.project.files import decode, read_bytes
from idlc.project.lock import Obstacle, Tree, is_same
from idlc.project.root import Root
from idlc.project.write import Change, Plan, difference


class FileOutcome(NamedTuple):
    """A file and its outcome: `created`, `edited`, `replaced` or `unchanged`."""

    path: str
    what: str


class Project:
    """A package's folder, existing or not; `name` is its name in reports."""

    def __init__(self, name: str, root: Root, report: Report, *, force: bool = False) -> None:
        self.name = name
        self.path: Path = root.absolute(name)
        self._report = report
        self._force = force

    def shown(self, path: str) -> str:
        """Return the name of a file in the folder for reports."""
        return path if self.name in ("", ".") else f"{self.name}/{path}"

    def has(self, path: str) -> bool:
        """Return whether a file or folder of this name exists."""
        return (self.path / path).exists()

    def text(self, path: str) -> str | None:
        """Return a file's text, `None` without one; no byte order mark, which edits keep."""
        if not (self.path / path).is_file():
            return None
        data = read_bytes(self.path / path, self.shown(path), self._report)
        source = None if data is None else decode(data, self.shown(path), self._report)
        return source.text.removeprefix("\ufeff") if source else None

    def names(self, folder: str) -> list[str]:
        """Return the names of the files in one of its folders, sorted."""
        try:
            return sorted(path.name for path in (self.path / folder).iterdir() if path.is_file())
        except OSError:
            return []

    def plan(
        self, added: Mapping[str, str], edited: Mapping[str, str] | None = None
    ) -> tuple[Plan, list[FileOutcome]] | None:
        """Return the changes that write files; `None` if something is in the way.

        `edited` texts replace what was read before; `added` ones only an equal file, unless the
        folder is written with force. Reports IDL614 and IDL620.
        """
        edited = edited or {}
        changes: list[Change] = []
        done: list[FileOutcome] = []
        refused = False
        tree = Tree(self.path)
        for path, text in sorted({**added, **edited}.items()):
            old, new = tree.read(path), text.encode("utf-8")
            if path in edited and isinstance(old, bytes) and old.startswith(BOM_UTF8):
                new = BOM_UTF8 + new
            if isinstance(old, Obstacle):
                self._in_the_way(path, old)
                refused = True
            elif is_same(old, new):
                done.append(FileOutcome(path, "unchanged"))
            elif old is None:
                changes.append(Change(path, None, new))
                done.append(FileOutcome(path, "created"))
            elif path in edited:
                changes.append(Change(path, old, new))
                done.append(FileOutcome(path, "edited"))
            elif self._force:
                changes.append(Change(path, old, new, backup=True))
                done.append(FileOutcome(path, "replaced"))
            else:
                self._differs(path, old, new)
                refused = True
        return None if refused else (Plan(self.path, tuple(changes), {}), done)

    def apply(self, plan: Plan) -> bool:
        """Make planned changes, all or none; report IDL612 and return `False` otherwise."""
        return write.apply_changes(plan, self.name, self._report)

    def diff(self, plan: Plan) -> Iterator[str]:
        """Yield the lines of a unified diff of planned changes."""
        for change in plan.changes:
            path = self.shown(change.path)
            before = f"a/{path}" if change.old is not None else "/dev/null"
            old, new = (
                (data or b"").decode("utf-8", errors="replace").splitlines(keepends=True)
                for data in (change.old, change.new)
            )
            for line in difflib.unified_diff(old, new, before, f"b/{path}"):
                yield line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n"
            if not old and not new:
                yield f"--- {before}\n+++ b/{path}\n"

    def _in_the_way(self, path: str, obstacle: Obstacle) -> None:
        shown = self.shown(path)
        message = f"cannot write `{shown}`: {obstacle.what}"
        self._report.add(codes.FOREIGN_FILE.of(shown, message, hint="move it away"))

    def _differs(self, path: str, old: bytes, new: bytes) -> None:
        shown = self.shown(path)
        self._report.add(
            codes.EXISTING_FILE.of(
                shown,
                f"`{shown}` exists and is not what would be written",
                hint="keep it and choose another name, or run again with --force, which keeps "
                "a copy",
                detail="\n".join(difference(old, new)),
            )
        )
