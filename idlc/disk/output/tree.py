"""What lies in a package folder, seen without following links below it."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from idlc.disk.read import content, kind_of, reason

#: A path of a file that idlc may have written below a folder: a few plain names.
_OWN = re.compile(r"(?:[\w-][\w.-]*/){0,7}[\w-][\w.-]*", re.ASCII)


def may_be_own(path: str) -> bool:
    """Return whether idlc may have written a file of this path, as a record of unknown origin says.

    Such a path stays below its folder.
    """
    return len(path) < 1000 and _OWN.fullmatch(path) is not None


class Obstacle(NamedTuple):
    """Something in the way of a file: a link, a folder where it belongs, what cannot be read."""

    what: str


class Tree:
    """A folder's files by relative path. Folders in it are looked at once."""

    def __init__(self, root: Path) -> None:
        self._root = str(root)
        self._folders: dict[str, Obstacle | bool] = {"": True}

    def read(self, path: str) -> bytes | Obstacle | None:
        """Return a file's content, what else is there, or `None` for nothing."""
        folder = self._folder(path.rpartition("/")[0])
        if folder is not True:
            return folder or None
        here = f"{self._root}/{path}"
        try:
            status = os.lstat(here)
            if stat.S_ISREG(status.st_mode):
                return content(here, status.st_size)
            return Obstacle(_is(path, status.st_mode))
        except FileNotFoundError:
            return None
        except OSError as error:
            return Obstacle(f"`{path}` cannot be read: {reason(error)}")

    def renamed(self, old: Iterable[str], new: Iterable[str]) -> dict[str, str]:
        """Return which of the old files lie under new names that differ in capitals only.

        They do where a file system ignores capitals, as those of Windows and macOS.
        """
        names = {path.casefold(): path for path in new}
        pairs = ((path, names.get(path.casefold())) for path in old)
        return {path: name for path, name in pairs if name and self._is_one(path, name)}

    def _is_one(self, path: str, other: str) -> bool:
        try:
            first, second = (os.lstat(f"{self._root}/{one}") for one in (path, other))
        except OSError:
            return False
        return path != other and os.path.samestat(first, second)

    def _folder(self, path: str) -> Obstacle | bool:
        """Return whether a folder is there, or what is there instead of it or above it."""
        known = self._folders.get(path)
        if known is None:
            above = self._folder(path.rpartition("/")[0])
            known = self._look(path) if above is True else above
            self._folders[path] = known
        return known

    def _look(self, path: str) -> Obstacle | bool:
        try:
            mode = os.lstat(f"{self._root}/{path}").st_mode
        except FileNotFoundError:
            return False
        except OSError as error:
            return Obstacle(f"`{path}` cannot be read: {reason(error)}")
        return True if stat.S_ISDIR(mode) else Obstacle(_is(path, mode))


def _is(path: str, mode: int) -> str:
    if stat.S_ISLNK(mode):
        return f"`{path}` is a symbolic link"
    return f"`{path}` is {'a file' if stat.S_ISREG(mode) else kind_of(mode)}"
