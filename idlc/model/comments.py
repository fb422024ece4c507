"""Comment lines → condensed comment and unit (spec section 1.4)."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from typing import NamedTuple

# a comma makes it a range, not a unit
_UNIT = re.compile(r"(\s*\[([^,\]]+)\])")


class Comment(NamedTuple):
    """A condensed comment: its lines, and the unit that stood in brackets, if one did."""

    lines: tuple[str, ...] = ()
    unit: str | None = None


def condense(lines: Sequence[str]) -> Comment:
    """Return the comment that rosidl makes of an element's comment lines, `#` already removed."""
    if not lines:
        return Comment()
    unit: str | None = None
    kept = list(lines)
    found = _UNIT.findall("\n".join(lines)) if any("[" in line for line in lines) else []
    if len(found) == 1:
        whole, unit = found[0]
        kept = [line.replace(whole, "") for line in kept]
    while kept and not kept[0]:
        del kept[0]
    while kept and not kept[-1]:
        del kept[-1]
    kept = [line for at, line in enumerate(kept) if line or kept[at - 1]]
    return Comment(tuple(textwrap.dedent("\n".join(kept)).split("\n")) if kept else (), unit)
