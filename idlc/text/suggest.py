"""Suggestions for misspelt names."""

from __future__ import annotations

from collections.abc import Iterable


def edit_distance(left: str, right: str) -> int:
    """Return how many insertions, removals, changes and swaps turn one text into the other."""
    before: list[int] = []
    row = list(range(len(right) + 1))
    for i, a in enumerate(left, 1):
        last, before, row = before, row, [i]
        for j, b in enumerate(right, 1):
            best = min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (a != b))
            if i > 1 and j > 1 and a == right[j - 2] and b == left[i - 2]:
                best = min(best, last[j - 2] + 1)
            row.append(best)
    return row[-1]


def closest(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that is nearest, or `None` if none is near."""
    if len(name) > 100:
        return None
    limit = len(name) // 3 + 1
    best: tuple[int, str] | None = None
    for candidate in known:
        if abs(len(candidate) - len(name)) > limit:
            continue
        distance = edit_distance(name.lower(), candidate.lower())
        if distance <= limit and (best is None or (distance, candidate) < best):
            best = distance, candidate
    return best[1] if best else None


def did_you_mean(name: str, known: Iterable[str]) -> str | None:
    """Return the hint that names the nearest known name, or `None`."""
    found = closest(name, known)
    return f"did you mean `{found}`?" if found else None
