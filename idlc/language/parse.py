"""Source → syntax tree. Never raises on a user's text: what is no definition becomes `Broken`."""

from __future__ import annotations

import re
from functools import lru_cache
from types import ModuleType
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
    known = terminals()
    size = known["SIZE"]
    return re.compile(
        rf"(?P<type>(?P<base>{known['TYPE_NAME']})(?:<=(?P<bound>{size}))?"
        rf"(?P<array>\[(?:(?P<most><=)?(?P<size>{size}))?\])?) \s*"
        rf"(?:(?P<field>{known['NAME']})(?: \s*(?P<default>{known['DEFAULT']}))?"
        rf"|(?P<constant>{known['CONSTANT_NAME']})?(?P<sign>=)(?P<value>{known['VALUE']})?)"
    )


def quick_lines(text: str) -> tuple[object, ...] | None:
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


def quick_definition(text: str) -> tree.Body | None:
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


#: Longer lines are parsed again rather than remembered.
SHARED_LENGTH = 1000


def _lalr() -> ModuleType:
    from idlc.language import lalr

    return lalr


def parse(source: Source) -> tree.File:
    """Return the sections and lines of a file; always succeeds."""
    text = source.text
    if not text or text[-1] not in LINE_ENDS:
        text += "\n"
    parts = cast("Any", quick_lines(text) or _lalr().lines(text))
    sections = parts[::2]
    separators = parts[1::2]
    starts = (0, *(source.line_starts_after(offset) for offset in separators))
    return tree.File(
        source,
        tuple(tree.Section(start, lines) for start, lines in zip(starts, sections, strict=True)),
        separators,
    )


def parse_any(source: Source) -> tree.File | idl.File:
    """Return the syntax of a file of either language; always succeeds."""
    if not source.is_idl:
        return parse(source)
    from idlc.language.idl import parse_idl  # only recordings hold IDL

    return parse_idl(source)


def parse_definition(text: str) -> tree.Body:
    """Return what the code of one line is; `text` is a `Line.definition` and not empty."""
    return _shared(text) if len(text) < SHARED_LENGTH else _parse_definition_at(text)


def _parse_definition_at(text: str) -> tree.Body:
    return quick_definition(text) or cast("tree.Body", _lalr().definition(text))


_shared = lru_cache(maxsize=4096)(_parse_definition_at)
