"""Comment lines → condensed comment and unit (spec section 1.4)."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from typing import NamedTuple

from idlc.syntax.escapes import EscapeError, through_idl
from idlc.text import codes

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


class Problem(NamedTuple):
    """A comment that breaks ROS 2's pipeline; `text` is the guilty piece of it."""

    code: codes.Code
    text: str
    message: str
    hint: str


def problem(comment: Comment) -> Problem | None:
    """Return what is wrong with a comment or its unit (spec 1.4, 1.5), or `None`."""
    if comment.unit is not None and "\n" in comment.unit:
        return Problem(
            codes.UNIT_ACROSS_LINES,
            "[",
            "a bracket that closes in another line; ROS 2's tools fail on such a unit",
            "close the bracket in the same line",
        )
    for text in (*comment.lines, *filter(None, [comment.unit])):
        try:
            through_idl(text)
        except EscapeError as error:
            return Problem(
                codes.BAD_ESCAPE,
                text[error.start : error.end],
                f"ROS 2's tools fail on {error} in a comment",
                "write the path or formula without backslashes",
            )
    return None
