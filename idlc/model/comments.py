"""Comment lines → condensed comment and unit (language 1.4)."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice

import msgspec

from idlc.diagnostics import codes
from idlc.language.escapes import EscapeError, through_idl
from idlc.language.tree import Fault

# a comma makes it a range, not a unit
_UNIT_END = re.compile(r"[,\]]")
_DEPRECATED = re.compile(r"\s*deprecated:\s*(.*)", re.IGNORECASE)


class Comment(msgspec.Struct, frozen=True):
    """A condensed comment: its lines, and the unit from its brackets, if there is one."""

    lines: tuple[str, ...] = ()
    unit: str | None = None


def condense(lines: Sequence[str]) -> Comment:
    """Return the comment that rosidl makes of an element's comment lines, `#` already removed."""
    if not lines:
        return Comment()
    unit: str | None = None
    kept = list(lines)
    units = list(islice(brackets("\n".join(lines)), 2))
    if len(units) == 1:
        whole, unit = units[0]
        kept = [line.replace(whole, "") for line in kept]
    filled = [at for at, line in enumerate(kept) if line]
    kept = kept[filled[0] : filled[-1] + 1] if filled else []
    kept = [line for at, line in enumerate(kept) if line or kept[at - 1]]
    if len(kept) == 1:
        return Comment((kept[0].lstrip(" \t"),), unit)
    return Comment(tuple(textwrap.dedent("\n".join(kept)).split("\n")) if kept else (), unit)


def brackets(text: str) -> Iterator[tuple[str, str]]:
    r"""Yield the matches of `(\s*\[([^,\]]+)\])` in `text`, looking at each character once.

    These may be units: the whole with the whitespace before it, and the text between the brackets.
    """
    start = 0
    at = text.find("[")
    while at >= 0 and (end := _UNIT_END.search(text, at)):
        if end[0] == "]" and end.start() > at + 1:
            head = text[start:at]
            yield text[start + len(head.rstrip()) : end.end()], text[at + 1 : end.start()]
            start = end.end()
        at = text.find("[", end.end())


def deprecation(lines: Iterable[str]) -> str | None:
    """Return the text after `deprecated:` at the start of a line of a comment, `None` without it.

    It names what to use instead, in a word or more.
    """
    match = next(filter(None, map(_DEPRECATED.match, lines)), None)
    return None if match is None else match[1].strip() or "no longer used"


def problem(comment: Comment) -> tuple[str, Fault] | None:
    """Return the text that breaks ROS 2's pipeline (language 1.4, 1.5), and its fault, or `None`.

    The text is a piece of the comment or of its unit.
    """
    if comment.unit is not None and "\n" in comment.unit:
        message = "ROS 2's tools fail on a unit whose bracket closes on another line"
        hint = "close the bracket on the same line"
        return "[", Fault(codes.UNIT_ACROSS_LINES, message, 0, 1, hint)
    for text in (*comment.lines, *filter(None, [comment.unit])):
        try:
            through_idl(text)
        except EscapeError as error:
            piece = text[error.start : error.end]
            message = f"ROS 2's tools fail on {error} in a comment"
            hint = "write the path or formula without backslashes"
            return piece, Fault(codes.BAD_ESCAPE, message, 0, len(piece), hint)
    return None
