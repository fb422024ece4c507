"""The code of a line → the syntax tree of its definition, by `grammar.lark`. Never raises."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple, cast

from lark import Lark, Token, Transformer, v_args
from lark.exceptions import UnexpectedInput

from idlc.diagnostics import codes
from idlc.language import tree
from idlc.language.tree import Piece, piece

#: Lines of at most so many characters are parsed once: files share some, and edits change few.
COMMON = 200


class _Array(NamedTuple):
    """The array part of a type: its fields in `tree.Type`."""

    brackets: Piece | None = None
    at_most: bool = False
    size: Piece | None = None


@v_args(inline=True)
class _Builder(Transformer):  # type: ignore[type-arg]  # generic in lark 1.x only
    """Builds syntax trees; the methods are the rules of the grammar."""

    def field(self, type_: tree.Type, name: Token, default: Token | None) -> tree.Field:
        return tree.Field(type_, piece(name), piece(default) if default else None)

    def constant(
        self, type_: tree.Type, name: Token | None, equals: Token, value: Token | None
    ) -> tree.Constant:
        sign = piece(equals)
        before = Piece(name.rstrip(), piece(name).start) if name else Piece("", sign.start)
        return tree.Constant(type_, before, piece(value) if value else Piece("", sign.end))

    def type(self, name: Token, bound: Token | None, array: _Array | None) -> tree.Type:
        array = array or _Array()
        whole = name + (f"<={bound}" if bound else "")
        whole += array.brackets.text if array.brackets else ""
        start = piece(name).start
        return tree.Type(Piece(whole, start), piece(name), piece(bound) if bound else None, *array)

    def array(self, *tokens: Token) -> _Array:
        brackets = Piece("".join(tokens), piece(tokens[0]).start)
        return _Array(brackets, len(tokens) == 4, piece(tokens[-2]) if len(tokens) > 2 else None)


@lru_cache(maxsize=1)
def _lark() -> Lark:
    """Return the parser; `literal` is a start because lark drops terminals that no rule uses."""
    return Lark(
        Path(__file__).with_name("grammar.lark").read_text(encoding="utf-8"),
        parser="lalr",
        start=["definition", "literal"],
        transformer=_Builder(),
        maybe_placeholders=True,  # `None` for a part that is not there
    )


@lru_cache
def pattern(terminal: str) -> str:
    """Return the regular expression of a terminal of the grammar."""
    return _lark().get_terminal(terminal).pattern.to_regexp()


def parse_definition(text: str) -> tree.Body:
    """Return the definition on one line; `text` is a `Line.definition` and not empty."""
    return (_parse if len(text) > COMMON else _parse_common)(text)


def _parse(text: str) -> tree.Body:
    try:
        return cast("tree.Body", _lark().parse(text, start="definition"))
    except UnexpectedInput as error:
        return _fault(text, getattr(error, "pos_in_stream", None) or 0)


_parse_common = lru_cache(maxsize=4096)(_parse)


def _fault(text: str, place: int) -> tree.Fault:
    """Return the problem of a `text` that is no definition; lark gives up at `place`."""
    space = re.search(pattern("_SPACE"), text)
    start, end = 0, space.start() if space else len(text)
    type_ = text[:end]
    if text[0].isspace():
        code, end = codes.INDENTED_DEFINITION, len(text) - len(text.lstrip())
        message = "a definition must begin in the first column"
        hint = "remove the whitespace before it"
    elif text == "---":
        code, message = codes.MALFORMED_SEPARATOR, "a separator must be alone on its line"
        hint = "remove the whitespace or comment after it"
    elif not text.strip("-"):
        code, message = codes.MALFORMED_SEPARATOR, f"`{text}` is not a separator"
        hint = "a separator is a line of exactly three dashes, `---`"
    elif space is None:
        code, message = codes.MISSING_NAME, f"missing name after `{type_}`"
        hint = "write `TYPE name`; a comment begins with `#`"
    else:
        code, message = codes.MALFORMED_TYPE, f"malformed type `{type_}`"
        hint = "write `T`, `T[]`, `T[3]`, `T[<=3]`, `string<=10` or `package/Name`"
        if type_.count("[") > 1:
            hint = "arrays cannot be nested; move the inner array into a message"
        elif "<" in type_ and "<=" not in type_:
            hint = "an upper bound is written `<=`, as in `string<=10` or `int32[<=10]`"
        start = min(place, end - 1)
    return tree.Fault(code, message, start, end, hint)
