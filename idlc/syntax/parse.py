"""Source → syntax tree. Never raises on a user's text: what is no definition becomes `Broken`."""

from __future__ import annotations

from functools import lru_cache
from types import ModuleType
from typing import TYPE_CHECKING, Any, cast

from idlc.diagnostics.source import Source
from idlc.syntax import quick, tree
from idlc.syntax.grammar import LINE_ENDS

if TYPE_CHECKING:
    from idlc.syntax import idl_tree

#: Longer lines are parsed again rather than remembered.
SHARED_LENGTH = 1000


def _lalr() -> ModuleType:
    from idlc.syntax import lalr

    return lalr


def parse(source: Source) -> tree.File:
    """Return the sections and lines of a file; always succeeds."""
    text = source.text
    if not text or text[-1] not in LINE_ENDS:
        text += "\n"
    parts = cast("Any", quick.lines(text) or _lalr().lines(text))
    sections = parts[::2]
    separators = parts[1::2]
    starts = (0, *(source.line_starts_after(offset) for offset in separators))
    return tree.File(
        source,
        tuple(tree.Section(start, lines) for start, lines in zip(starts, sections, strict=True)),
        separators,
    )


def parse_any(source: Source) -> tree.File | idl_tree.File:
    """Return the syntax of a file of either language; always succeeds."""
    if not source.is_idl:
        return parse(source)
    from idlc.syntax.idl import parse_idl  # only recordings hold IDL

    return parse_idl(source)


def parse_definition(text: str) -> tree.Body:
    """Return what the code of one line is; `text` is a `Line.definition` and not empty."""
    return _shared(text) if len(text) < SHARED_LENGTH else _definition(text)


def _definition(text: str) -> tree.Body:
    return quick.definition(text) or cast("tree.Body", _lalr().definition(text))


_shared = lru_cache(maxsize=4096)(_definition)
