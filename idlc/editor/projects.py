"""Folders that are checked, and what is known of them: those of the workspace, and of stray files.

What is known follows from what is on disk and what is open, never from the way there.
"""

from __future__ import annotations

import gc
from collections.abc import Iterable, Iterator
from pathlib import Path

from idlc.check.compiler import InternalError
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic
from idlc.editor.documents import Document, Documents
from idlc.editor.workspace import State, Wishes, Workspace, alone
from idlc.project.files import is_folder
from idlc.project.find import KINDS


class Project:
    """A folder that is checked."""

    def __init__(self, workspace: Workspace) -> None:
        self.workspace = workspace
        self.folder = workspace.folder
        self._documents: Documents | None = None
        self._state: State | None = None
        #: What went wrong within idlc itself.
        self.failure: Diagnostic | None = None

    @property
    def is_loaded(self) -> bool:
        """Whether what is on disk was read."""
        return self._documents is not None

    def is_current(self) -> bool:
        """Return whether there is nothing else on disk than was read."""
        if self._documents is None:
            return self.failure is not None or not is_folder(self.folder)
        return self.workspace.is_current()

    def forget(self) -> None:
        """Let everything be read again when it is needed."""
        self._documents = self._state = None

    def follow(self, path: Path, data: bytes | None) -> None:
        """Take note that other text counts for a file, `None` for what is on disk."""
        if self._documents is None:
            return
        counts = self.workspace.counts(path)
        if counts is not None and data == counts:
            return
        if data is not None and self.workspace.change(path, data):
            self._state = None
        elif counts is not None or self.workspace.concerns(path):
            self.forget()

    def state(self, documents: Documents) -> State | None:
        """Return what is known now; `None` if the folder cannot be looked at."""
        if self._state is None:
            self.failure = None
            anew = self._documents is None
            try:
                self.load(documents)
                self._state = self.workspace.state()
                if anew:
                    gc.freeze()  # what a whole folder is read into is no garbage
            except OSError:
                self.forget()
            except Exception as error:
                self.failure = _failure(error, self.folder)
        return self._state

    def load(self, documents: Documents) -> None:
        """Read what is on disk, unless that was done; raises OSError."""
        if self._documents is None:
            self.workspace.load(documents.texts())
            self._documents = documents

    def has(self, path: Path) -> bool:
        """Return whether a file is one of those that are checked, as far as was looked."""
        return self._documents is not None and self.workspace.counts(path) is not None

    def holds(self, path: Path, documents: Documents) -> bool:
        """Return whether a file is one of those that are checked."""
        try:
            self.load(documents)
        except Exception:  # of which `state` tells
            return False
        return self.has(path)


def _failure(error: Exception, folder: Path) -> Diagnostic:
    cause, where, subject = error, "", str(folder)
    if isinstance(error, InternalError):
        where, subject = f" in stage `{error.stage}`", error.subject
        cause = error.__cause__ if isinstance(error.__cause__, Exception) else error
    return codes.INTERNAL_ERROR.of(
        subject,
        f"idlc failed{where}: {type(cause).__name__}: {cause}",
        hint="this is a bug in idlc, please report it",
    )


class Projects:
    """The folders of the workspace, and those of open files that are in none of them."""

    def __init__(self, documents: Documents) -> None:
        self._documents = documents
        #: Whether folders are to be read again of which the client has not been told since.
        self.have_news = False
        self._wishes = Wishes()
        self._folders: dict[Path, Project] = {}
        self._strays: dict[tuple[Path, tuple[str, ...]], Project] = {}

    def __iter__(self) -> Iterator[Project]:
        """Yield the projects, the innermost of two first."""
        every = (*self._folders.values(), *self._strays.values())
        return iter(sorted(every, key=lambda one: len(one.folder.parts), reverse=True))

    def settle(self, wishes: Wishes) -> None:
        """Take other settings."""
        if wishes != self._wishes:
            self._wishes = wishes
            folders, self._folders = self._folders, {}
            self._strays.clear()
            self.add(folders)

    def add(self, folders: Iterable[Path]) -> None:
        """Add folders of the workspace; a whole disk or home is none, which would take minutes."""
        for folder in folders:
            if folder not in (folder.parent, Path.home()):
                self._folders.setdefault(folder, Project(Workspace(folder, self._wishes)))
        self._strays.clear()

    def remove(self, folders: Iterable[Path]) -> None:
        """Remove folders of the workspace."""
        for folder in folders:
            self._folders.pop(folder, None)
        self._strays.clear()

    def forget(self) -> None:
        """Let everything be read again when it is needed."""
        self.have_news = True
        for project in self:
            project.forget()

    def follow(self, document: Document, data: bytes | None) -> None:
        """Take note that other text counts for a document, `None` for what is on disk."""
        if document.path is not None:
            for project in self:
                project.follow(document.path, data)

    def changed_on_disk(self, paths: Iterable[Path]) -> None:
        """Take note that files changed; the text of an open one counts as before."""
        for path in paths:
            for project in self:
                project.follow(path, None)

    def notice_changes(self) -> bool:
        """Let folders be read again that changed on disk; return whether any did."""
        changed = [one for one in self if not one.is_current()]
        for project in changed:
            project.forget()
        self.have_news |= bool(changed)
        return bool(changed)

    def all(self) -> list[Project]:
        """Return every project, with those that open files need which are in no other."""
        strays: dict[Path, list[tuple[str, ...]]] = {}
        for document in self._documents:
            path = document.path
            if path is None or path.suffix not in KINDS:
                continue
            if not any(one.holds(path, self._documents) for one in self._folders.values()):
                folder, paths = alone(path)
                strays.setdefault(folder, []).append(paths)
        wanted = {(folder, _together(paths)): folder for folder, paths in strays.items()}
        self._strays = {
            key: self._strays.get(key) or Project(Workspace(folder, self._wishes, key[1]))
            for key, folder in wanted.items()
        }
        return list(self)

    def of(self, path: Path) -> Project | None:
        """Return the innermost project that holds a file."""
        return next((one for one in self.all() if one.holds(path, self._documents)), None)


def _together(paths: Iterable[tuple[str, ...]]) -> tuple[str, ...]:
    return tuple(sorted({one for some in paths for one in some}))
