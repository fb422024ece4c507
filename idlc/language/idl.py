"""IDL text → its syntax. Never raises: `broken` is the first place that ROS 2 would not write."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, cast

import msgspec
from lark import Lark, Token, Transformer, v_args
from lark.exceptions import UnexpectedInput

from idlc.diagnostics.source import Source, Span
from idlc.language.tree import Piece


class Element(msgspec.Struct, frozen=True):
    """A type without arrays: `double`, `string<5>`, `demo__msg__Part` or `std_msgs::msg::Header`.

    `name` is the first of its parts, or with several the whole of them.
    """

    name: Piece
    parts: tuple[str, ...]
    bound: Piece | None = None


class Sequence(msgspec.Struct, frozen=True):
    """`sequence<T>` or `sequence<T, N>`."""

    element: Element
    bound: Piece | None = None


class Typedef(msgspec.Struct, frozen=True):
    """Another name for a type, or for an array of it."""

    type: Element | Sequence
    name: Piece
    size: Piece | None = None


class Value(msgspec.Struct, frozen=True):
    """A number, `TRUE` or `FALSE`; or texts in quotes, one after the other."""

    pieces: tuple[Piece, ...]

    @property
    def is_text(self) -> bool:
        """True for texts in quotes."""
        return self.pieces[0].text.startswith('"')

    @property
    def whole(self) -> Piece:
        """A piece as long as all of it; its text is the first piece's."""
        length = self.pieces[-1].end - self.pieces[0].start
        return Piece(self.pieces[0].text.ljust(length), self.pieces[0].start)


class Annotation(msgspec.Struct, frozen=True):
    """`@name (parameter=value, ...)`."""

    name: Piece
    parameters: Mapping[str, Value]


class IdlConstant(msgspec.Struct, frozen=True):
    """`const TYPE NAME = VALUE;`."""

    annotations: tuple[Annotation, ...]
    type: Element | Sequence
    name: Piece
    value: Value


class Constants(msgspec.Struct, frozen=True):
    """The module of a structure's constants."""

    name: Piece
    constants: tuple[IdlConstant, ...]


class Member(msgspec.Struct, frozen=True):
    """`TYPE NAME;`."""

    annotations: tuple[Annotation, ...]
    type: Element | Sequence
    name: Piece


class Structure(msgspec.Struct, frozen=True):
    """`struct NAME { ... };`."""

    annotations: tuple[Annotation, ...]
    name: Piece
    members: tuple[Member, ...]


class IdlFile(msgspec.Struct, frozen=True):
    """A file; `broken` is the first word that ROS 2 would not write, where there is one."""

    source: Source
    package: Piece = Piece("", 0)
    kind: Piece = Piece("", 0)
    parts: tuple[Typedef | Constants | Structure, ...] = ()
    broken: Piece | None = None

    def span(self, piece: Piece) -> Span:
        """Return the range of a piece."""
        return Span(self.source, piece.start, piece.end)


_WORD = re.compile(r"\w+|\S")


def _piece(token: Token) -> Piece:
    """Return a token as a piece."""
    position: Any = token.start_pos  # Optional in lark 1.x, an int in the stubs of 0.12
    return Piece(str(token), int(position))


def _optional(token: Token | None) -> Piece | None:
    return None if token is None else _piece(token)


@v_args(inline=True)
class _IdlBuilder(Transformer):  # type: ignore[type-arg]  # generic in lark 1.x only
    """Builds the syntax while lark reduces; the method names are the grammar's rules."""

    def file(self, *parts: Any) -> tuple[Any, ...]:
        package, kind, *rest = (part for part in parts if part is not None)
        return _piece(package), _piece(kind), tuple(rest)

    def include(self, _: Token) -> None:
        return None

    def typedef(self, type_: Any, name: Token, size: Token | None = None) -> Typedef:
        return Typedef(type_, _piece(name), _optional(size))

    def constants(self, name: Token, *constants: IdlConstant) -> Constants:
        return Constants(_piece(name), constants)

    def constant(self, *parts: Any) -> IdlConstant:
        *annotations, type_, name, value = parts
        return IdlConstant(tuple(annotations), type_, _piece(name), value)

    def struct(self, *parts: Any) -> Structure:
        at = next(i for i, part in enumerate(parts) if isinstance(part, Token))
        return Structure(parts[:at], _piece(parts[at]), parts[at + 1 :])

    def member(self, *parts: Any) -> Member:
        *annotations, type_, name = parts
        return Member(tuple(annotations), type_, _piece(name))

    def type(self, type_: Any) -> Any:
        return type_

    def sequence(self, element: Element, bound: Token | None = None) -> Sequence:
        return Sequence(element, _optional(bound))

    def element(self, *tokens: Token) -> Element:
        bound = _piece(tokens[-1]) if tokens[-1].type == "SIZE" else None
        names = [_piece(token) for token in tokens if token.type == "NAME"]
        parts = tuple(name.text for name in names)
        return Element(Piece("::".join(parts), names[0].start), parts, bound)

    def annotation(self, name: Token, *parameters: tuple[str, Any]) -> Annotation:
        return Annotation(_piece(name), dict(parameters))

    def parameter(self, name: Token, value: Value) -> tuple[str, Value]:
        return str(name), value

    def value(self, *tokens: Token) -> Value:
        return Value(tuple(map(_piece, tokens)))


@lru_cache(maxsize=1)
def _lark() -> Lark:
    grammar = Path(__file__).with_name("idl.lark").read_text(encoding="utf-8")
    return Lark(
        grammar, parser="lalr", start="file", transformer=_IdlBuilder(), maybe_placeholders=False
    )


def parse_idl(source: Source) -> IdlFile:
    """Return the syntax of an .idl file; always succeeds."""
    try:
        package, kind, parts = cast("Any", _lark().parse(source.text))
    except UnexpectedInput as error:
        return IdlFile(source, broken=_place(source.text, error))
    return IdlFile(source, package, kind, parts)


def _place(text: str, error: UnexpectedInput) -> Piece:
    """Return the first word that the grammar does not allow; empty at the end of the text."""
    token = getattr(error, "token", None)
    at_end = token is not None and token.type == "$END"
    start = len(text) if at_end else getattr(error, "pos_in_stream", None) or 0
    word = _WORD.search(text, start)
    return Piece(word[0], word.start()) if word else Piece("", len(text))
