"""IDL text → lark's tree. Never raises: `broken` is the first place that ROS 2 would not write."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path
from typing import Any

import msgspec
from lark import Lark
from lark.exceptions import UnexpectedInput

from idlc.diagnostics.source import Source
from idlc.language.tree import Piece


class IdlFile(msgspec.Struct, frozen=True):
    """A file; `broken` is the first word that ROS 2 would not write, where there is no `tree`.

    The data of the tree's nodes are the rules of `idl.lark`.
    """

    source: Source
    tree: Any = None
    broken: Piece | None = None


_WORD = re.compile(r"\w+|\S")


@lru_cache(maxsize=1)
def _lark() -> Lark:
    grammar = Path(__file__).with_name("idl.lark").read_text(encoding="utf-8")
    return Lark(grammar, parser="lalr", start="file", maybe_placeholders=False)


def parse_idl(source: Source) -> IdlFile:
    """Return the syntax of an .idl file; always succeeds."""
    try:
        return IdlFile(source, _lark().parse(source.text))
    except UnexpectedInput as error:
        return IdlFile(source, broken=_place(source.text, error))


def _place(text: str, error: UnexpectedInput) -> Piece:
    """Return the first word that the grammar does not allow; empty at the end of the text."""
    token = getattr(error, "token", None)
    at_end = token is not None and token.type == "$END"
    start = len(text) if at_end else getattr(error, "pos_in_stream", None) or 0
    word = _WORD.search(text, start)
    return Piece(word[0], word.start()) if word else Piece("", len(text))
