"""The grammar without lark, for the lines that nearly all files consist of.

lark takes longer to start than all other work on a file. What these patterns, which are the
grammar's own terminals, do not match as a whole is left to lark.
"""

from __future__ import annotations

import re
from functools import lru_cache

from idlc.syntax import tree
from idlc.syntax.grammar import LINE_ENDS, terminals

_UNUSUAL_ENDS = frozenset(LINE_ENDS[1:])
_SEPARATOR = "---"


@lru_cache(maxsize=1)
def _definition() -> re.Pattern[str]:
    known = terminals()
    size = known["SIZE"]
    return re.compile(
        rf"(?P<type>(?P<base>{known['TYPE_NAME']})(?:<=(?P<bound>{size}))?"
        rf"(?P<array>\[(?:(?P<most><=)?(?P<size>{size}))?\])?) \s*"
        rf"(?:(?P<field>{known['NAME']})(?: \s*(?P<default>{known['DEFAULT']}))?"
        rf"|(?P<constant>{known['CONSTANT_NAME']})?(?P<sign>=)(?P<value>{known['VALUE']})?)"
    )


def lines(text: str) -> tuple[object, ...] | None:
    """Return what `lalr.lines` returns, or `None` for a text with unusual line ends."""
    if not _UNUSUAL_ENDS.isdisjoint(text):
        return None
    parts: list[object] = []
    section: list[tree.Line] = []
    start = 0
    for line in text[:-1].split("\n"):
        if line == _SEPARATOR:
            parts += [tuple(section), start]
            section = []
        else:
            code, sign, comment = line.partition("#")
            section.append(tree.Line(start, code, sign + comment, "\n"))
        start += len(line) + 1
    return (*parts, tuple(section))


def definition(text: str) -> tree.Body | None:
    """Return what `lalr.definition` returns, or `None` for code that is not an ordinary line."""
    found = _definition().fullmatch(text) if text.isprintable() else None
    if found is None:
        return None
    type_ = tree.Type(
        _piece(found, "type"),
        _piece(found, "base"),
        _optional(found, "bound"),
        _optional(found, "array"),
        bool(found["most"]),
        _optional(found, "size"),
    )
    if found["field"] is not None:
        return tree.Field(type_, _piece(found, "field"), _optional(found, "default"))
    name, value = _optional(found, "constant"), _optional(found, "value")
    return tree.constant(type_, name, found.start("sign"), value, len(text))


def _piece(found: re.Match[str], group: str) -> tree.Piece:
    return tree.Piece(found[group], found.start(group))


def _optional(found: re.Match[str], group: str) -> tree.Piece | None:
    return None if found[group] is None else _piece(found, group)
