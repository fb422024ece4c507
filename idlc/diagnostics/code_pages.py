"""The page of each code: what it means, why, an example that triggers it and one that is right.

The pages are data of idlc, one Markdown file per code in `explain/`.
"""

from __future__ import annotations

from importlib.resources import files

from idlc.diagnostics.codes import CODES, find
from idlc.diagnostics.suggest import closest

SECTIONS = ("## Why", "## Bad", "## Good")


def page(word: str) -> str | None:
    """Return the Markdown page of a code, given by id or name; `None` if there is none."""
    known = find(word)
    if known is None:
        return None
    path = files("idlc.diagnostics") / "explain" / f"{known.id}.md"
    return path.read_text(encoding="utf-8") if path.is_file() else None


def close_name(word: str) -> str | None:
    """Return the id or name of a code that is nearest to a word, `None` if none is near."""
    return closest(word.upper(), CODES) or closest(word, (known.slug for known in CODES.values()))
