"""Source → syntax tree: sections of lines, whose code `definition.py` parses. Never raises.

A line has code, then a comment from the first `#` on, even inside quotes. A .msg file has one
section, a .srv file two (request, response), a .action file three (goal, result, feedback).
Only recordings contain IDL; lark makes its tree.
"""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path
from typing import Any

import msgspec
from lark import Lark
from lark.exceptions import UnexpectedInput

from idlc.diagnostics.source import Source
from idlc.language import tree
from idlc.language.tree import Piece

#: The characters that end a line, as `str.splitlines` has it (language 1.1).
LINE_ENDS = "\n\r\x0b\x0c\x1c\x1d\x1e\x85\u2028\u2029"


def parse(source: Source) -> tree.File:
    """Return the sections and lines of a file; always succeeds."""
    sections: list[tree.Section] = []
    separators: list[int] = []
    lines: list[tree.Line] = []
    first = start = 0
    for line in source.text.splitlines(keepends=True) or ("",):
        text = line.rstrip(LINE_ENDS)
        end = start + len(line)
        if text == "---":
            sections.append(tree.Section(first, tuple(lines)))
            separators.append(start)
            lines = []
            first = end
        else:
            code, sign, comment = text.partition("#")
            lines.append(tree.Line(start, code, sign + comment, line[len(text) :] or "\n"))
        start = end
    return tree.File(source, (*sections, tree.Section(first, tuple(lines))), tuple(separators))


def parse_any(source: Source) -> tree.File | IdlFile:
    """Return the syntax of a file of either language; always succeeds."""
    return parse_idl(source) if source.is_idl else parse(source)


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
