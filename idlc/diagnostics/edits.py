"""Applying edits to a text."""

from __future__ import annotations

from collections.abc import Iterable

from idlc.diagnostics.report import Edit


def apply(text: str, edits: Iterable[Edit]) -> tuple[str, int]:
    """Return a text with edits made, and how many; one that overlaps an earlier one is left out."""
    parts: list[str] = []
    at = done = 0
    for edit in sorted(dict.fromkeys(edits), key=lambda one: (one.span.start, one.span.end)):
        if edit.span.start < at:
            continue
        parts += [text[at : edit.span.start], edit.text]
        at = edit.span.end
        done += 1
    return "".join([*parts, text[at:]]), done
