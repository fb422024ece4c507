"""The parser that lark makes of the grammar, for the few lines that `parse` cannot read quickly.

Loading lark takes longer than most commands need, so `parse` imports this where it needs it.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple, cast

from lark import Lark, Token, Transformer, v_args
from lark.exceptions import UnexpectedInput

from idlc.diagnostics import codes
from idlc.language import tree
from idlc.language.grammar import grammar


def piece(token: Token) -> tree.Piece:
    """Return a token as a piece."""
    return tree.Piece(str(token), _start(token))


def _start(token: Token) -> int:
    position: Any = token.start_pos  # Optional in lark 1.x, an int in the stubs of 0.12
    return int(position)


class _Array(NamedTuple):
    at_most: bool
    size: tree.Piece | None


@v_args(inline=True)
class _Builder(Transformer):  # type: ignore[type-arg]  # generic in lark 1.x only
    """Builds tree nodes while lark reduces; the method names are the grammar's rules."""

    def line(self, *tokens: Token) -> tree.Line:
        parts = {token.type.lower(): str(token) for token in tokens}
        return tree.Line(_start(tokens[0]), **parts)

    def separator(self, token: Token) -> int:
        return _start(token)

    def section(self, *lines: tree.Line) -> tuple[tree.Line, ...]:
        return lines

    def file(self, *parts: Any) -> tuple[Any, ...]:
        return parts

    def string_bound(self, _: Token, size: Token) -> tree.Piece:
        return piece(size)

    def array(self, *tokens: Token) -> _Array:
        return _Array(len(tokens) == 2, piece(tokens[-1]) if tokens else None)

    def type(self, name: Token, *parts: Any) -> tuple[Any, ...]:
        return (piece(name), *parts)

    def field(self, name: Token, default: Token | None = None) -> tuple[Any, ...]:
        return piece(name), None if default is None else piece(default)

    def constant(self, *tokens: Token) -> dict[str, tree.Piece]:
        return {token.type: piece(token) for token in tokens}

    def definition(self, type_: tuple[Any, ...], body: Any) -> tuple[Any, ...]:
        return type_, body


@lru_cache(maxsize=1)
def _lark() -> Lark:
    return Lark(
        grammar(),
        parser="lalr",
        start=["file", "definition", "literal"],
        transformer=_Builder(),
        maybe_placeholders=False,
    )


def lines(text: str) -> tuple[Any, ...]:
    """Return sections as tuples of lines, and the offsets of the separators between them.

    `text` ends with a line end.
    """
    return cast("tuple[Any, ...]", _lark().parse(text, start="file"))


def definition(text: str) -> tree.Body:
    """Return the definition on one line; `text` is a `Line.definition` and not empty."""
    if text[0].isspace():
        return _broken_indent(text)
    try:
        type_parts, body = cast("Any", _lark().parse(text, start="definition"))
    except UnexpectedInput as error:
        return _broken(text, error)
    type_ = _type(text, *type_parts)
    if isinstance(body, tuple):
        return tree.Field(type_, *body)
    equals = text.index("=", type_.whole.end)
    return tree.constant(type_, body.get("CONSTANT_NAME"), equals, body.get("VALUE"), len(text))


def _type(text: str, name: tree.Piece, *parts: tree.Piece | _Array) -> tree.Type:
    end = text.index(" ")
    whole = tree.Piece(text[:end], 0)
    bound: tree.Piece | None = None
    for part in parts:
        if isinstance(part, tree.Piece):
            bound = part
        else:
            start = text.rindex("[", 0, end)
            brackets = tree.Piece(text[start:end], start)
            return tree.Type(whole, name, bound, brackets, part.at_most, part.size)
    return tree.Type(whole, name, bound)


def _broken_indent(text: str) -> tree.Broken:
    blank = len(text) - len(text.lstrip())
    return tree.Broken(
        codes.INDENTED_DEFINITION,
        tree.Piece(text[:blank], 0),
        "a definition must begin in the first column",
        "remove the white space before it",
    )


def _broken(text: str, error: UnexpectedInput) -> tree.Broken:
    """Return the problem of a `text` that is no definition, without lark's words for it."""
    type_, space, _ = text.partition(" ")
    whole = tree.Piece(type_, 0)
    if set(type_) == {"-"} and not space:
        alone = type_ == "---"
        return tree.Broken(
            codes.MALFORMED_SEPARATOR,
            whole,
            "a separator must be alone on its line" if alone else f"`{type_}` is not a separator",
            "remove the blanks or the comment after it"
            if alone
            else "a separator is a line of exactly three dashes, `---`",
        )
    if not space:
        hint = "write `TYPE name`; a comment begins with `#`"
        return tree.Broken(codes.MISSING_NAME, whole, f"`{type_}` has no name after it", hint)
    at = min(getattr(error, "pos_in_stream", None) or 0, len(type_) - 1)
    return tree.Broken(
        codes.MALFORMED_TYPE,
        tree.Piece(type_[at:], at) if at else whole,
        f"malformed type `{type_}`",
        _type_hint(type_),
    )


def _type_hint(type_: str) -> str:
    if type_.count("[") > 1:
        return "arrays do not nest; put the inner array into a message of its own"
    if "<" in type_ and "<=" not in type_:
        return "an upper bound is written `<=`, as in `string<=10` or `int32[<=10]`"
    return "write `T`, `T[]`, `T[3]`, `T[<=3]`, `string<=10` or `package/Name`"
