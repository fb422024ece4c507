"""IDL text → its syntax. Never raises: what ROS 2 would not write is the `broken` place."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path
from typing import Any, cast

from lark import Lark, Token, Transformer, v_args
from lark.exceptions import UnexpectedInput

from idlc.diagnostics.source import Source
from idlc.syntax import idl_tree
from idlc.syntax.lalr import piece
from idlc.syntax.tree import Piece

_WORD = re.compile(r"\w+|\S")


def _optional(token: Token | None) -> Piece | None:
    return None if token is None else piece(token)


@v_args(inline=True)
class _Builder(Transformer):  # type: ignore[type-arg]  # generic in lark 1.x only
    """Builds the syntax while lark reduces; the method names are the grammar's rules."""

    def file(self, *parts: Any) -> tuple[Any, ...]:
        package, kind, *rest = (part for part in parts if part is not None)
        return piece(package), piece(kind), tuple(rest)

    def include(self, _: Token) -> None:
        return None

    def typedef(self, type_: Any, name: Token, size: Token | None = None) -> idl_tree.Typedef:
        return idl_tree.Typedef(type_, piece(name), _optional(size))

    def constants(self, name: Token, *constants: idl_tree.Constant) -> idl_tree.Constants:
        return idl_tree.Constants(piece(name), constants)

    def constant(self, *parts: Any) -> idl_tree.Constant:
        *annotations, type_, name, value = parts
        return idl_tree.Constant(tuple(annotations), type_, piece(name), value)

    def struct(self, *parts: Any) -> idl_tree.Structure:
        at = next(i for i, part in enumerate(parts) if isinstance(part, Token))
        return idl_tree.Structure(parts[:at], piece(parts[at]), parts[at + 1 :])

    def member(self, *parts: Any) -> idl_tree.Member:
        *annotations, type_, name = parts
        return idl_tree.Member(tuple(annotations), type_, piece(name))

    def type(self, type_: Any) -> Any:
        return type_

    def sequence(self, element: idl_tree.Element, bound: Token | None = None) -> idl_tree.Sequence:
        return idl_tree.Sequence(element, _optional(bound))

    def element(self, *tokens: Token) -> idl_tree.Element:
        bound = piece(tokens[-1]) if tokens[-1].type == "SIZE" else None
        names = [piece(token) for token in tokens if token.type == "NAME"]
        parts = tuple(one.text for one in names)
        return idl_tree.Element(Piece("::".join(parts), names[0].start), parts, bound)

    def annotation(self, name: Token, *parameters: tuple[str, Any]) -> idl_tree.Annotation:
        return idl_tree.Annotation(piece(name), dict(parameters))

    def parameter(self, name: Token, value: idl_tree.Value) -> tuple[str, idl_tree.Value]:
        return str(name), value

    def value(self, *tokens: Token) -> idl_tree.Value:
        return idl_tree.Value(tuple(map(piece, tokens)))


@lru_cache(maxsize=1)
def _lark() -> Lark:
    grammar = Path(__file__).with_name("idl.lark").read_text(encoding="utf-8")
    return Lark(
        grammar, parser="lalr", start="file", transformer=_Builder(), maybe_placeholders=False
    )


def parse_idl(source: Source) -> idl_tree.File:
    """Return the syntax of an .idl file; always succeeds."""
    try:
        package, kind, parts = cast("Any", _lark().parse(source.text))
    except UnexpectedInput as error:
        return idl_tree.File(source, broken=_place(source.text, error))
    return idl_tree.File(source, package, kind, parts)


def _place(text: str, error: UnexpectedInput) -> Piece:
    """Return the first word that cannot stand where it stands; empty at the end of the text."""
    token = getattr(error, "token", None)
    at_end = token is not None and token.type == "$END"
    start = len(text) if at_end else getattr(error, "pos_in_stream", None) or 0
    found = _WORD.search(text, start)
    return Piece(found[0], found.start()) if found else Piece("", len(text))
