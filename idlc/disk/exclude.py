"""Files that are left out: by patterns in pyproject.toml and on the command line."""

from __future__ import annotations

from collections.abc import Iterable
from fnmatch import fnmatchcase
from pathlib import Path

import msgspec


class Exclusion(msgspec.Struct, frozen=True):
    """Patterns such as `msg/ros1/**` or `old_*`, and the folder that their paths are seen from.

    `*` and `?` stand for any text within one name, `**` for any number of folders. A pattern may
    begin at any folder, and one that fits a folder leaves out everything in it.
    """

    patterns: tuple[tuple[str, ...], ...] = ()
    base: Path = Path("/")

    def has(self, path: str | Path) -> bool:
        """Return whether the file of an absolute path is left out."""
        if not self.patterns:
            return False
        whole = Path(path)
        below = self.base if whole.is_relative_to(self.base) else whole.anchor
        names = whole.relative_to(below).parts
        return any(_fits(pattern, names) for pattern in self.patterns)


class Exclusions(msgspec.Struct, frozen=True):
    """All that is left out."""

    parts: tuple[Exclusion, ...] = ()

    def has(self, path: str | Path) -> bool:
        """Return whether the file of an absolute path is left out."""
        return any(part.has(path) for part in self.parts)

    def seen_from(self, place: Path, top: Path) -> Exclusions:
        """Return the same for a copy of the folder `top` that lies in `place`."""
        return Exclusions(
            tuple(
                msgspec.structs.replace(part, base=place / part.base.relative_to(top))
                if part.base.is_relative_to(top)
                else part
                for part in self.parts
            )
        )


def exclusion(patterns: Iterable[str], base: Path) -> Exclusion:
    """Return what patterns leave out, as they are written in the folder `base`."""
    split = (pattern.replace("\\", "/").split("/") for pattern in patterns)
    named = (tuple(name for name in names if name not in ("", ".")) for names in split)
    return Exclusion(tuple(filter(None, named)), base)


def _fits(pattern: tuple[str, ...], names: Iterable[str]) -> bool:
    """Return whether a pattern fits a file or a folder above it, from any folder on."""
    reached = _with_none(pattern, {0})
    for name in names:
        after = {0}
        for place in reached:
            if pattern[place] == "**":
                after.add(place)
            elif fnmatchcase(name, pattern[place]):
                after.add(place + 1)
        reached = _with_none(pattern, after)
        if len(pattern) in reached:
            return True
    return False


def _with_none(pattern: tuple[str, ...], places: set[int]) -> set[int]:
    """Return places in a pattern, with those that are reached where `**` stands for no folder."""
    for place in sorted(places):
        while place < len(pattern) and pattern[place] == "**":
            place += 1
            places.add(place)
    return places
