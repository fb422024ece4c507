"""Import statements, sorted as linters want them."""

from __future__ import annotations

import re
from collections.abc import Collection

from idlc.emit import python_lines


def natural(name: str) -> list[tuple[int, str]]:
    """Return a key that sorts numbers in names by their value."""
    parts = re.findall(r"\d+|\D+", name)
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts]


def _order(name: str) -> tuple[bool, list[tuple[int, str]]]:
    is_constant = name.isupper() and len(name) > 1  # as linters see it
    return not is_constant, natural(name)


def statements(module: str, names: Collection[str], indent: int = 0) -> list[str]:
    """Return the lines that import names from a module; `X as Y` has a statement of its own."""
    statements = [(name,) for name in names if " as " in name]
    plain = sorted((name for name in names if " as " not in name), key=_order)
    ordered = sorted([*statements, *([tuple(plain)] if plain else [])])
    return [line for one in ordered for line in python_lines.import_from(module, one, indent)]
