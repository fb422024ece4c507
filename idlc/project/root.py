"""The folder that paths are relative to, with the texts that an editor has open.

It is passed to all code that reads files, so that none depends on the process's working folder.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.project import files, lock
from idlc.project.files import is_file

MANIFEST = "package.xml"


class Root:
    """A base folder, an absolute path, and texts by absolute path that count instead of files.

    The package.xml around a folder and the locks in a folder are searched once and remembered, so
    a root is for one run of a command, or for one load of a workspace.
    """

    def __init__(self, base: Path, texts: Mapping[Path, bytes] = MappingProxyType({})) -> None:
        self.base = base
        self._texts = texts
        self._base = str(base)
        self._above = f"{base}{os.sep}"
        self._manifests: dict[Path, Path | None] = {}
        self._locks: dict[Path, tuple[lock.Lock, ...]] = {}
        self._links: dict[Path, frozenset[str] | None] = {}

    @classmethod
    def here(cls) -> Root:
        """Return the root of a command: the working folder, with nothing open."""
        return cls(Path.cwd())

    @classmethod
    def at(cls, folder: Path, texts: Mapping[Path, bytes] = MappingProxyType({})) -> Root:
        """Return the root that a command has after `cd`; raises OSError if the folder is gone."""
        base = folder.resolve(strict=True)
        if not files.is_folder(base):
            raise NotADirectoryError(str(folder))
        return cls(base, texts)

    def on_disk(self) -> Root:
        """Return a root of the same folder in which nothing is open or remembered."""
        return Root(self.base)

    def path(self, path: str | Path) -> str:
        """Return the path to open; `..` after a link is left to the operating system."""
        return os.path.join(self._base, path)  # noqa: PTH118 - a Path costs more than the look

    def absolute(self, path: str | Path) -> Path:
        """Return an absolute path without `..`, in which links are not resolved."""
        return Path(os.path.normpath(self.path(path)))

    def shown(self, path: Path) -> str:
        """Return a path for messages: relative to the base if it is below the base."""
        whole = str(path)
        if whole.startswith(self._above):  # as `relative_to` says, in a fraction of the time
            return whole[len(self._above) :].replace(os.sep, "/")
        try:
            return path.relative_to(self.base).as_posix()
        except ValueError:
            return path.as_posix()

    def relative(self, path: Path) -> str:
        """Return a path relative to the base, with `..` where it leads out of it.

        Raises ValueError for a path on another drive.
        """
        return os.path.relpath(path, self._base)

    def read_bytes(self, path: str | Path, name: str, report: Report) -> bytes | None:
        """Return a file's bytes, or its open text; report as `files.read_bytes` does."""
        data = self._texts.get(self.absolute(path)) if self._texts else None
        if data is None:
            if self.leads_out(place := self.path(path)):
                report.add(files.leading_out(name))
                return None
            return files.read_bytes(Path(place), name, report)
        if len(data) > files.MAX_SIZE:
            report.add(files.too_large(name))
            return None
        return data

    def read_source(self, path: str | Path, name: str, report: Report) -> Source | None:
        """Return a file's text, or its open text; report why there is none."""
        data = self.read_bytes(path, name, report)
        return None if data is None else files.decode(data, name, report)

    def is_file(self, path: str | Path) -> bool:
        """Return whether a file exists, on disk or only in the editor."""
        if is_file(self.path(path)):
            return True
        return bool(self._texts) and self.absolute(path) in self._texts

    def leads_out(self, path: str) -> bool:
        """Return whether a path is a link that git tracks, and leads out of the repository.

        Links that git does not track are the user's. If git cannot tell, none is.
        """
        if not os.path.islink(path):  # noqa: PTH114 - asked of every file that is read
            return False
        from idlc.project.git import repository_of, tracked_links

        link = Path(path)
        try:
            link.stat()  # the system follows a few links only, so that few are resolved
            place, target = link.parent.resolve() / link.name, link.resolve()
        except OSError:
            return False
        top = repository_of(place.parent)
        if top is None or (target.is_relative_to(top) and not target.is_relative_to(top / ".git")):
            return False
        if top not in self._links:
            self._links[top] = tracked_links(top)
        links = self._links[top]
        return links is None or place.relative_to(top).as_posix() in links

    def is_open(self, path: Path) -> bool:
        """Return whether an open text counts instead of the file at an absolute path."""
        return path in self._texts

    def unsaved_below(self, folder: Path) -> Iterator[Path]:
        """Yield the paths below an absolute folder that exist in the editor only."""
        for path in self._texts:
            if path.is_relative_to(folder) and not is_file(path):
                yield path

    def manifest(self, folder: Path) -> Path | None:
        """Return the nearest package.xml at or above an absolute folder, within its repository."""
        if folder not in self._manifests:
            self._manifests[folder] = _nearest_manifest(folder)
        return self._manifests[folder]

    def locks(self, folder: Path) -> tuple[lock.Lock, ...]:
        """Return the locks of the generated packages in an absolute folder."""
        if folder not in self._locks:
            records = (lock.load_lock(place, "", Report()) for place in files.entries(folder))
            self._locks[folder] = tuple(record for record in records if record is not None)
        return self._locks[folder]


def _nearest_manifest(folder: Path) -> Path | None:
    for directory in map(str, (folder, *folder.parents)):
        path = os.path.join(directory, MANIFEST)  # noqa: PTH118 - a Path costs more than the look
        if is_file(path):
            return Path(path)
        if os.path.exists(os.path.join(directory, ".git")):  # noqa: PTH110, PTH118 - or a worktree's file
            break
    return None
