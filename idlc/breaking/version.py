"""Which part of a version number a comparison asks to raise."""

from __future__ import annotations

import re
from typing import Literal

from idlc.breaking.packages import Comparison


def part_to_raise(comparison: Comparison) -> Literal["major", "minor", "patch"] | None:
    """Return the part that semantic versioning asks to raise, `None` if nothing is different."""
    levels = {level for change in comparison.changes for level in change.levels}
    if levels & {"wire", "hash", "source"}:
        return "major"
    if levels or comparison.additions:
        return "minor"
    return "patch" if comparison.differs else None


def raised(version: str, part: Literal["major", "minor", "patch"]) -> str | None:
    """Return a version with a part raised, `None` for one that is not three numbers.

    Before 1.0.0 there is no promise to keep, so a breaking change raises the minor part.
    """
    found = re.fullmatch(r"(\d+)\.(\d+)\.(\d+)", version.strip())
    if found is None:
        return None
    major, minor, patch = map(int, found.groups())
    if part == "patch":
        return f"{major}.{minor}.{patch + 1}"
    if part == "minor" or not major:
        return f"{major}.{minor + 1}.0"
    return f"{major + 1}.0.0"
