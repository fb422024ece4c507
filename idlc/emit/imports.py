"""Import statements, sorted and broken as linters and formatters want them."""

from __future__ import annotations

import re
from collections.abc import Collection

from idlc.emit.python_lines import WIDTH


def natural(name: str) -> list[tuple[int, str]]:
    """Return a key that sorts numbers in names by their value."""
    parts = re.findall(r"\d+|\D+", name)
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts]


def _order(name: str) -> tuple[bool, list[tuple[int, str]]]:
    is_constant = name.isupper() and len(name) > 1  # as linters see it
    return not is_constant, natural(name)


def import_from(module: str, names: Collection[str], indent: int = 0) -> list[str]:
    """Return the lines that import names from a module; `X as Y` has a statement of its own."""
    statements = [(name,) for name in names if " as " in name]
    plain = sorted((name for name in names if " as " not in name), key=_order)
    margin, head = " " * indent, f"from {module} import "
    result = []
    for one in sorted([*statements, *([tuple(plain)] if plain else [])]):
        line = f"{margin}{head}{', '.join(one)}"
        if len(line) <= WIDTH or " as " in line:
            result.append(line)
        else:
            items = [f"{margin}    {name}," for name in one]
            result += [f"{margin}{head}(", *items, f"{margin})"]
    return result
