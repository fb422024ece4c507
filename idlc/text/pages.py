"""The page behind each code: what it means, why, an example that triggers it and one that is right.

The pages are data of idlc, one Markdown file per code in `explain/`.
"""

from __future__ import annotations

from importlib.resources import files

from idlc.text.codes import CODES
from idlc.text.suggest import closest

SECTIONS = ("## Why", "## Bad", "## Good")


def page(code: str) -> str | None:
    """Return the Markdown page of a code, given in any case; `None` if there is none."""
    known = CODES.get(code.upper())
    if known is None:
        return None
    path = files("idlc.text") / "explain" / f"{known.id}.md"
    return path.read_text(encoding="utf-8") if path.is_file() else None


def close_code(code: str) -> str | None:
    """Return the code that `code` may stand for: a slug, digits alone, or a near miss."""
    word = code.lower().removeprefix("idl").strip("-_ ")
    for known in CODES.values():
        if word in (known.slug, known.id[3:]):
            return known.id
    return closest(code.upper(), CODES) or closest(word, (known.slug for known in CODES.values()))
