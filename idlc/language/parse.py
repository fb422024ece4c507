"""Source → syntax tree. Never raises on a user's text: a line without meaning becomes `Broken`."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import TYPE_CHECKING, Any, cast

from idlc.diagnostics.source import Source
from idlc.language import tree
from idlc.language.grammar import LINE_ENDS, terminals

if TYPE_CHECKING:
    from idlc.language import idl

_UNUSUAL_ENDS = frozenset(LINE_ENDS[1:])
_SEPARATOR = "---"


@lru_cache(maxsize=1)
def _definition() -> re.Pattern[str]:
    patterns = terminals()
    size = patterns["SIZE"]
    return re.compile(
        rf"(?P<type>(?P<base>{patterns['TYPE_NAME']})(?:<=(?P<bound>{size}))?"
        rf"(?P<array>\[(?:(?P<most><=)?(?P<size>{size}))?\])?) \s*"
        rf"(?:(?P<field>{patterns['NAME']})(?: \s*(?P<default>{patterns['DEFAULT']}))?"
        rf"|(?P<constant>{patterns['CONSTANT_NAME']})?(?P<sign>=)(?P<value>{patterns['VALUE']})?)"
    )


def quick_lines(text: str) -> tuple[object, ...] | None:
    """Return the same as `lalr.lines`, or `None` for a text with unusual line ends."""
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


def quick_definition(text: str) -> tree.Body | None:
    """Return the same as `lalr.definition`, or `None` for code that is not an ordinary line."""
    match = _definition().fullmatch(text) if text.isprintable() else None
    if match is None:
        return None
    type_ = tree.Type(
        _piece(match, "type"),
        _piece(match, "base"),
        _optional(match, "bound"),
        _optional(match, "array"),
        bool(match["most"]),
        _optional(match, "size"),
    )
    if match["field"] is not None:
        return tree.Field(type_, _piece(match, "field"), _optional(match, "default"))
    name, value = _optional(match, "constant"), _optional(match, "value")
    return tree.constant(type_, name, match.start("sign"), value, len(text))


def _piece(match: re.Match[str], group: str) -> tree.Piece:
    return tree.Piece(match[group], match.start(group))


def _optional(match: re.Match[str], group: str) -> tree.Piece | None:
    return None if match[group] is None else _piece(match, group)


#: Longer lines are parsed again rather than remembered.
SHARED_LENGTH = 1000


def _lines(text: str) -> tuple[Any, ...]:
    from idlc.language import lalr  # lark is slow to load, and few files need it

    return lalr.lines(text)


def parse(source: Source) -> tree.File:
    """Return the sections and lines of a file; always succeeds."""
    text = source.text
    if not text or text[-1] not in LINE_ENDS:
        text += "\n"
    parts = cast("Any", quick_lines(text) or _lines(text))
    sections = parts[::2]
    separators = parts[1::2]
    starts = (0, *(source.line_starts_after(offset) for offset in separators))
    return tree.File(
        source,
        tuple(tree.Section(start, lines) for start, lines in zip(starts, sections, strict=True)),
        separators,
    )


def parse_any(source: Source) -> tree.File | idl.IdlFile:
    """Return the syntax of a file of either language; always succeeds."""
    if not source.is_idl:
        return parse(source)
    from idlc.language.idl import parse_idl  # only recordings hold IDL

    return parse_idl(source)


def parse_definition(text: str) -> tree.Body:
    """Return the definition on one line; `text` is a `Line.definition` and not empty."""
    return _shared(text) if len(text) < SHARED_LENGTH else _parse_code(text)


def _parse_code(text: str) -> tree.Body:
    body = quick_definition(text)
    if body is not None:
        return body
    from idlc.language import lalr  # lark is slow to load, and few files need it

    return lalr.definition(text)


_shared = lru_cache(maxsize=4096)(_parse_code)
